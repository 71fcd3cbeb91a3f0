"""The paper's rig in another physics engine: an independent judge of what `armcal diagnose` names.

MuJoCo (PyPI) moves rigid links, springs, gaps, dry friction, servo loops and a hand; nothing here knows a formula of
armcal's model or of its simulated lab. `python -m mujoco_rig` makes one session; `judge.py` scores many.
"""
