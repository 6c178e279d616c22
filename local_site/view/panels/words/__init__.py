"""Words of the page, by concept: to translate or reword the page, these files are enough.

In: the console's state. Out: text. Next: the panels and the scene, which show it; `controls` names all that is pressed, moved or
chosen, `scripts` has the words of the browser's own part. A folder, because one file would be four screens too long.
"""
