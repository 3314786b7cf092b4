"""The panels of a tab, a small class each.

A view makes its widgets, says what they hold (`read`: the state with its own fields replaced) and
shows a frame (`draw`). Drawing never assigns a widget that the user can change.
"""
