"""Archives of recordings on several workers: local processes, or an existing Ray cluster.

    python -m sheetlight.batch MANIFEST --station cell3 --out batch1 --workers 2
    python -m sheetlight.batch MANIFEST --station cell3 --out batch1 --ray auto

Every worker runs `sheetlight batch --shard i/n`. docs/archives.md describes what that keeps to.
"""

from .driver import Batch, Ended, run

__all__ = ["Batch", "Ended", "run"]
