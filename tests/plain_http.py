"""Calls over plain HTTP, as all are that stay on this machine.

A client of ``httpx`` is ready for TLS: it reads the certificates of all authorities for 20 ms of
processor time, and a call outside a client makes one of its own. Give such calls
``verify=NO_TLS``.
"""

from __future__ import annotations

import ssl
from typing import Final

NO_TLS: Final = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
