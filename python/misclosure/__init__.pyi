from . import errors as errors
from .block import Block as Block
from .diagnosis import Diagnosis as Diagnosis
from .effects import Effect as Effect, effect as effect
from .errors import MisclosureError as MisclosureError
from .mistakes import Check as Check, Mended as Mended
from .plan import Plan as Plan
from .run import Covariance as Covariance, Run as Run
from .svg import Svg as Svg
from .tables import Record as Record, Records as Records, Table as Table

solvers: list[str]
__version__: str
