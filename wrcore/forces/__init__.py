"""Forces between bodies: suspension, drive, control. Each kind of force element has one file in
`wrcore.forces.kinds`.
"""
