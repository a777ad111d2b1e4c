"""Building blocks of self-contained HTML pages. No ROS here."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from maglev_monitor.report.drawing import Plot

REPLAY = 'replay.html'
"""What the flight in 3D is called, beside the report, where somebody has made it."""

_CSS = """
:root { color-scheme: light dark; --ink: #1d2733; --soft: #66727f; --line: #dfe4ea; --blue: #1f5fa8;
  --paper: #ffffff; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #dde3ea; --soft: #98a4b0; --line: #323c47; --blue: #5b9bdc; --paper: #12171d; }
  img { background: #ffffff; border-radius: .4rem; }
}
@media print {
  :root { --ink: #000000; --soft: #444444; --line: #cccccc; --paper: #ffffff; }
  body { max-width: none; padding: 0; }
  h2, img, tr, .caption, .panels > div { break-inside: avoid; }
  h2, .caption { break-after: avoid; }
}
* { box-sizing: border-box; }
body { font: 15px/1.55 system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif; color: var(--ink);
  margin: 0 auto; max-width: 1240px; padding: 2.2rem 1.4rem 4rem; background: var(--paper); }
header { border-bottom: 3px solid var(--blue); padding-bottom: 1rem; margin-bottom: 1.4rem; }
h1 { font-size: 1.7rem; margin: 0 0 .2rem; }
h2 { font-size: 1.15rem; margin: 2.2rem 0 .4rem; }
.sub, .caption, .note { color: var(--soft); }
.caption { margin: .1rem 0 .6rem; max-width: 62rem; }
.badge { display: inline-block; padding: .1rem .7rem; border-radius: 1rem; color: #fff;
  font-size: .95rem; vertical-align: .25rem; margin-left: .6rem; }
.pass { background: #2a8a62; } .fail { background: #b3321d; } .incomplete { background: #b07a10; }
.cards { display: flex; flex-wrap: wrap; gap: .8rem; margin: 1rem 0; }
.card { border: 1px solid var(--line); border-radius: .5rem; padding: .5rem .9rem;
  min-width: 8.5rem; }
.card b { display: block; font-size: 1.15rem; }
.card span { color: var(--soft); font-size: .85rem; }
.panels { display: grid; gap: .4rem 1.2rem; grid-template-columns: minmax(0, 1fr); }
@media (min-width: 720px), print {
  .columns2 { grid-template-columns: repeat(2, minmax(0, 1fr)); }
  .columns3 { grid-template-columns: repeat(3, minmax(0, 1fr)); }
}
.wide { overflow-x: auto; }
table { border-collapse: collapse; margin: .3rem 0 1rem; font-variant-numeric: tabular-nums; }
th, td { padding: .28rem .9rem; border-bottom: 1px solid var(--line); text-align: right; }
th { color: var(--soft); font-weight: 600; }
th:first-child, td:first-child, .words td { text-align: left; }
.figures td:not(:last-child) { white-space: nowrap; }
.words td + td { overflow-wrap: anywhere; }
@media (max-width: 480px) {
  body { padding: 1rem .8rem 2rem; }
  .figures table { font-size: .72rem; }
  th, td { padding: .25rem .15rem; }
}
ul { margin: .3rem 0; padding-left: 1.2rem; }
img { max-width: 100%; height: auto; display: block; }
"""

_FIT_PAPER = """
<script>
for (const [event, print] of [['beforeprint', true], ['afterprint', false]])
  addEventListener(event, () => document.querySelectorAll('.panels').forEach(panels => {
    const width = panels.clientWidth, columns = getComputedStyle(panels).gridTemplateColumns;
    panels.style.width = print ? `${width}px` : '';
    panels.style.gridTemplateColumns = print ? columns : '';
    panels.style.zoom = print ? Math.min(1, 680 / width) : '';
  }));
</script>
"""
"""Shrinks drawn panels as they are to the width of a sheet of A4 or letter paper [CSS px]."""


def page(title: str, parts: Iterable[str]) -> str:
    """A whole page of parts that are HTML; nothing is fetched, empty parts are left out."""
    head = (
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<title>{html.escape(title)} — maglev stage</title><style>{_CSS}</style></head><body>'
    )
    return '\n'.join([head, *(part for part in parts if part), _FIT_PAPER, '</body></html>\n'])


def header(title: str, verdict: str, words: Iterable[str]) -> str:
    """The head of a page: its title, pass, fail or incomplete, and a line below."""
    return (
        f'<header><h1>{html.escape(title)}<span class="badge {verdict}">{verdict}</span></h1>'
        f'<div class="sub">{html.escape(" · ".join(words))}</div></header>'
    )


def picture(plot: Plot) -> str:
    """A figure with its heading and caption, its PNG embedded."""
    image = base64.b64encode(plot.png).decode('ascii')
    title = html.escape(plot.title)
    return (
        f'<h2>{title}</h2>\n<p class="caption">{html.escape(plot.caption)}</p>\n'
        f'<img alt="{title}" src="data:image/png;base64,{image}">'
    )


def html_table(heads: Sequence[str], rows: Iterable[Sequence[str]], kind: str = 'figures') -> str:
    """A table of plain text, of ``figures`` or ``words``."""
    head = ''.join(f'<th>{html.escape(name)}</th>' for name in heads)
    body = ''.join(
        '<tr>' + ''.join(f'<td>{html.escape(cell)}</td>' for cell in row) + '</tr>' for row in rows
    )
    return f'<div class="wide {kind}"><table><tr>{head}</tr>{body}</table></div>'


def bullets(title: str, lines: Sequence[str]) -> str:
    """A list of plain text under a title; nothing when it is empty."""
    if not lines:
        return ''
    items = ''.join(f'<li>{html.escape(line)}</li>' for line in lines)
    return f'<p class="note">{html.escape(title)}:</p><ul>{items}</ul>'
