"""The one exception of the package."""


class SheetlightError(Exception):
    """What went wrong, the likely cause, and the next step.

    Attributes:
        what: what happened, with the number seen and its limit.
        cause: the likely cause, in one sentence; empty where nothing is likely.
        next: the next step, in one sentence; empty where there is none.
    """

    what: str
    cause: str
    next: str

    def __init__(self, what: str, cause: str = "", next: str = "") -> None:
        super().__init__(what, cause, next)
        self.what, self.cause, self.next = what, cause, next

    def __str__(self) -> str:
        text = self.what
        if self.cause:
            text += f"\n  likely cause: {self.cause}"
        if self.next:
            text += f"\n  next step: {self.next}"
        return text
