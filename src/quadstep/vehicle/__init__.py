"""What flies: the paper's equations (`paper/`), a real vehicle's (`airframe/`), and the plants made of them (`plants/`).

Laws over numbers; rooms from `control` up may import it.
"""
