"""Judgement of the answer as HTML: evidence of optimality, certificates, published values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ...evidence.optimality import CURVED
from ...results.checkwording import published_table
from ...results.data import CertificateData, CombinedData, CombinedResult, OptimalityData, SolveResult
from ...results.rounding import number, size_of_F
from ...results.tables import active_table
from ...results.wording import certificate_lines, evidence_lines
from ...results.workspacewording import proof_lines, proof_tables
from .charts import Curve, Spot, line_chart
from .markup import Markup, html_table, join_markup, paragraphs, tag
from .report import Report


def evidence_section(report: Report) -> Markup:
    """Return the evidence of optimality, from the program alone."""
    result = report.result
    if isinstance(result, SolveResult):
        return join_markup(_evidence_of(result))
    parts: list[Markup] = []
    for part, own in zip(report.parts, result.tasks, strict=True):
        parts += [tag("h3", f"“{part.name}” by itself"), *_evidence_of(own)]
    optimality = result.combined.optimality
    if optimality is not None:
        parts += [tag("h3", "The combined program"), tag("p", f"Verdict: {optimality.kind.value}.")]
        parts.append(
            _active(result.combined, optimality, result.combined.value or 0.0, is_answer=result.status.is_answer)
        )
    return join_markup(parts)


def _evidence_of(result: SolveResult) -> Iterator[Markup]:
    """Yield the evidence about one program's point."""
    yield paragraphs(evidence_lines(result))
    optimality = result.optimality
    if optimality is None:
        return
    size = 0.0 if result.robot is None else size_of_F(result.robot)
    yield _active(result, optimality, size, is_answer=result.status.is_answer)
    if optimality.reduced_hessian_eigenvalues and result.reached is None:
        values = optimality.reduced_hessian_eigenvalues
        listed = ", ".join(number(value, 1.0, digits=4, part=CURVED) for value in values)
        yield tag("p", f"Curvatures along the directions that are left, in scaled variables: {listed}.")


def _active(result: SolveResult | CombinedData, optimality: OptimalityData, size: float, *, is_answer: bool) -> Markup:
    if not optimality.active:
        return tag("p", "No bound or limit is active.")
    table = active_table(result, size, is_answer=is_answer)
    words = {cell for row in table.rows for cell in row}
    caption = " and ".join(word for word in ("violated", "active") if word in words).capitalize()
    return html_table(table, f"{caption} bounds and limits")


def certificate_section(report: Report) -> Markup:
    """Return the proven bounds, and the course of each search."""
    result = report.result
    found: list[tuple[str, CertificateData | None]] = []
    if isinstance(result, CombinedResult):
        pairs = zip(report.parts, result.tasks, strict=True)
        found += [(f"“{part.name}” by itself", own.certificate) for part, own in pairs]
        found.append(("The combined program", result.combined.certificate))
    else:
        found.append(("", result.certificate))
    parts: list[Markup] = []
    if report.refusal:
        parts.append(tag("p", f"Refused: {report.refusal}.", class_="warning"))
    for name, certificate in found:
        if certificate is None:
            continue
        if name:
            parts.append(tag("h3", name))
        parts.append(paragraphs(certificate_lines(certificate)))
        parts += bound_chart(certificate.history)
    return join_markup(parts)


def workspace_section(report: Report) -> Markup:
    """Return the proof of the design over its workspace; empty where no limit holds there."""
    result = report.result
    if isinstance(result, CombinedResult) or result.workspace is None:
        return Markup("")
    tables = (
        html_table(each, each.title, id=f"workspace-{each.name}")
        for each in proof_tables(report.case, result.workspace)
    )
    return join_markup([paragraphs(proof_lines(result.workspace)), *tables])


def bound_chart(history: Sequence[Sequence[float]]) -> list[Markup]:
    """Return a chart of the bound and the incumbent against time, from a history of (seconds, bound, incumbent)."""
    if not history:
        return []
    if len(history) == 1:
        ((after, bound, found),) = history
        return [tag("p", f"It took one round: after {after:.3g} s the bound was {bound:.7g}, the best F {found:.7g}.")]
    seconds, bounds, best = ([row[k] for row in history] for k in range(3))
    words = (
        f"The bound goes from {bounds[0]:.7g} after {seconds[0]:.3g} s to {bounds[-1]:.7g} after {seconds[-1]:.3g} s; "
        f"the best F known from {best[0]:.7g} to {best[-1]:.7g}."
    )
    chart = line_chart(
        [Curve(seconds, bounds, "curve", steps=True), Curve(seconds, best, "curve best", steps=True)],
        [Spot(seconds[-1], bounds[-1], "spot", f"bound {bounds[-1]:.7g}")],
        words=words,
        labels=("seconds", "F"),
    )
    return [tag("figure", chart, tag("figcaption", f"Bound (blue) and best point known (orange). {words}"))]


def published_section(report: Report) -> Markup:
    """Return the published numbers beside the computed ones."""
    if report.check is None:
        return Markup("")
    caption = "What the literature prints beside what is computed here"
    return html_table(published_table(report.check), caption, id="compared")
