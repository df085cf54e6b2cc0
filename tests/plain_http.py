"""Calls over plain HTTP, as used for everything on this machine.

A client of ``httpx`` prepares for TLS by reading the certificates of all authorities, which takes
20 ms of processor time, and each call outside a client creates its own client. Give such calls
``verify=NO_TLS``.
"""

from __future__ import annotations

import ssl
from typing import Final

NO_TLS: Final = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
