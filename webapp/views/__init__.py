"""The panels of a tab, a small class each.

A view makes its widgets, says what they hold (`read`: the state with its own fields replaced) and
shows a frame (`draw`). Drawing never assigns a widget that the user can change.
"""

INDENT = "padding:0 var(--mantine-spacing-xs)"
"""CSS that makes text begin where the labels of widgets do."""
ATTENTION = "padding-left:0.5em;border-left:4px solid #F0E442;background:rgba(240,228,66,0.15)"
"""CSS of what needs it: yellow, the colour of no class."""
