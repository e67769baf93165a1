"""The equations of one wheelset on straight track in plain NumPy, as the paper writes them: read these first.

`contact` finds where wheel and rail overlap (Eqs. 1 to 6), `forces` has Hertz's contact and the creep laws (Eq. 7), and
`wheelset` the equations of motion (Eq. 8). Nothing is compiled. Profiles, the numbers of the creep table and the scene
are shared with the compiled core, code is not. Tests compare both: forces agree within 1e-8 of the wheel load where
patches are taken at the maximum of the penetration. The plain equations take some 3000 times as long.

Examples
--------
>>> import wrcore as wr
>>> from wrcore.reference.wheelset import plain_wheelset
>>> scene = wr.load_scene(wr.example("wheelset"), {"contact.patch": "moment"})
>>> table = wr.ensure_table(0.28).data
>>> plain = plain_wheelset(scene, table)
>>> import numpy as np
>>> p, height = [1.0, 0.0, 0.0, 0.0], plain.nominal[2] - 1e-4
>>> state = np.array([0.0, 0.001, height, *p, plain.speed, 0.0, 0.0, 0.0, plain.speed / plain.pair.rolling_radius, 0.0])
>>> plain.rates(0.0, state).shape
(13,)
"""
