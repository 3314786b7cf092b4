"""The look of a page: light or dark as the reader has it, and on paper."""

STYLE = """
:root { color-scheme: light dark; --line: #8886; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 1080px; margin: 2em auto; padding: 0 1em;
  background: Canvas; color: CanvasText; overflow-wrap: anywhere; }
h1, h2 { line-height: 1.2; } h2 { margin-top: 2em; border-bottom: 1px solid var(--line); }
code { display: block; padding: .7em; border: 1px solid var(--line); white-space: pre-wrap; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .15em .6em; border-bottom: 1px solid var(--line); text-align: left;
  vertical-align: top; }
td.n, th.n { text-align: right; white-space: nowrap; }
td svg { width: 100px; height: 10px; }
thead { display: table-header-group; } tr, figure, svg { break-inside: avoid; }
.wide { overflow-x: auto; }
.grid { display: grid; grid-template-columns: repeat(auto-fill, minmax(150px, 1fr)); gap: 12px; }
.plots { display: flex; flex-wrap: wrap; gap: 24px; } .plots figure { flex: 1 1 320px; }
figure { margin: 0; } figcaption { font-size: 12px; } img { max-width: 100%; height: auto; }
.swatch { display: inline-block; width: 1em; height: 1em; vertical-align: -.15em;
  border: 1px solid var(--line); print-color-adjust: exact; -webkit-print-color-adjust: exact; }
.warning { border-left: 4px solid #D55E00; padding-left: .7em; }
@media print { body { max-width: none; margin: 0; font-size: 10pt; color: #000; background: #fff; }
  .wide { overflow: visible; } .grid { grid-template-columns: repeat(5, 1fr); } }
"""
