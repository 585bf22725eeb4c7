# What type checkers and editors know of the package: the names that __init__.py loads when asked.
# Imports for them in __init__.py itself would have every room import the uppermost one.

from pathlib import Path

from sandmould.bad_input import BadInputError as BadInputError
from sandmould.notebook import Result as Result
from sandmould.notebook import again as again
from sandmould.notebook import plan as plan
from sandmould.notebook import run as run
from sandmould.notebook import status as status

ROOT: Path
IS_CHECKOUT: bool
SHIPPED: Path
__version__: str
