"""What models of contact do on a crossing: height of the wheel, load on the nose, pressure, cost."""
