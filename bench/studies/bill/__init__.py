"""`routes run`: cost and error of every route."""

from __future__ import annotations

from gradient_routes.bench.cases.study import Study

STUDY = Study(
    name="run",
    question="What does dJ/dp cost by every route named, on every problem named, and how wrong is it?",
    tables={},
    command="gradient_routes.bench.studies.bill.command:run",
    figures="gradient_routes.bench.studies.bill.figures:section",
)
