"""The study: one room per question, each named as its section in the configuration, its rules and its results.

paper           the paper's figures, its comparison and its timing table
contact         geometry of pairs, planar detection, reductions, the search
patch           what the patch model matters
creep           creep laws and tables against the exact solver and CONTACT
accuracy        speed against error
speeds          wheelset and trailer vehicle over speed
critical_speed  small motions and limit cycles
hard_cases      what the methods must keep, and where they break
cost            what each stage costs, over size, against other codes
ivp             a published benchmark of rigid wheelset dynamics
sweeps          many short runs
wear            worn profiles over a distance
report          the report and the notebooks
"""
