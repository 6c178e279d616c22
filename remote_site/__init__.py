"""Robot's site: supervision, motion, insertion, perception, reproduction and the machine.

In: commands, models and the operator's hand. Out: motion, reports, events. Next: `site` starts the process;
`robot` is one control period; `supervision` decides.
"""
