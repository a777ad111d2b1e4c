"""Typed parameters: one frozen dataclass is the table of a node's parameters. No ROS here."""

from maglev_model.parameters.files import DIFFERS as DIFFERS
from maglev_model.parameters.files import applies as applies
from maglev_model.parameters.files import differing as differing
from maglev_model.parameters.files import from_yaml as from_yaml
from maglev_model.parameters.files import read_argument as read_argument
from maglev_model.parameters.files import read_yaml as read_yaml
from maglev_model.parameters.files import to_yaml as to_yaml
from maglev_model.parameters.table import SHARED_GROUPS as SHARED_GROUPS
from maglev_model.parameters.table import ParameterError as ParameterError
from maglev_model.parameters.table import Spec as Spec
from maglev_model.parameters.table import build as build
from maglev_model.parameters.table import for_others as for_others
from maglev_model.parameters.table import group as group
from maglev_model.parameters.table import parameter as parameter
from maglev_model.parameters.table import replace as replace
from maglev_model.parameters.table import specs as specs
from maglev_model.parameters.table import unknown_parameter as unknown_parameter
from maglev_model.parameters.table import values as values
