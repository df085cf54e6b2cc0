"""What a user of Slewline imports: the client here, the planning core in ``slewline.core``.

>>> from slewline import Client
>>> Client("http://127.0.0.1:8000")
Client('http://127.0.0.1:8000')

The client's home is ``service.client``; this package only gives it the product's name.
"""

from planner_core import __version__
from service import client
from service.client import *  # noqa: F403  # its list of names is the one that counts

__all__ = ["__version__"]
__all__ += client.__all__
