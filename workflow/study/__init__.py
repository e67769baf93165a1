"""The study: one package per question, with the same name as its section in the configuration, rules and results.

paper           the paper's figures, its comparison and its timing table
contact         geometry of pairs, planar detection, reductions, the search
patch           influence of the contact patch model
creep           creep laws and tables against the exact solver and CONTACT
accuracy        error over computing time
speeds          wheelset and trailer vehicle over speed
critical_speed  small motions and limit cycles
hard_cases      invariants that every run must satisfy, and limits of the methods
cost            cost of each stage, over size, and compared with other codes
ivp             a published benchmark of rigid wheelset dynamics
sweeps          many short runs
wear            worn profiles over a distance
report          pages and tables that present the results
"""
