"""One wheelset on straight track in plain NumPy: the equations as one writes them down, nothing compiled.

To read, to check the kernels against, and as the slow end of the benchmark. Shared with the kernels are the profiles,
the creep table's numbers and the scene, no code.
"""
