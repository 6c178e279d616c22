"""Words of the page, by concept: to translate or reword the page, these files are what there is to read.

In: the console's state. Out: text. Next: the panels, which put it on the page; `scripts` has the words of the browser's own part.
"""
