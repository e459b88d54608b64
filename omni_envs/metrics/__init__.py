"""How good a robot motion is."""

from omni_envs.metrics.bars import BARS, Bar, bars_table
from omni_envs.metrics.evaluate import evaluate
from omni_envs.metrics.paper import PaperFigures, paper_figures, paper_row
from omni_envs.metrics.reach import Miss, missed_contacts
from omni_envs.metrics.report import ReferenceReport
from omni_envs.metrics.summary import summary_table

__all__ = [
    "BARS",
    "Bar",
    "Miss",
    "PaperFigures",
    "ReferenceReport",
    "bars_table",
    "evaluate",
    "missed_contacts",
    "paper_figures",
    "paper_row",
    "summary_table",
]
