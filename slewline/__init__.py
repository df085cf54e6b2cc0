"""What users of Slewline import: the client here, the planning core in ``slewline.core``.

>>> from slewline import Client
>>> Client("http://127.0.0.1:8000")
Client('http://127.0.0.1:8000')

The client is defined in ``service.client``; this package gives it the product's name.
"""

from planner_core import __version__
from service import client
from service.client import *  # noqa: F403  # its __all__ is the list of names

__all__ = ["__version__"]
__all__ += client.__all__
