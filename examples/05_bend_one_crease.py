"""How far one laser setting folds a sheet: the closed form beside the layered section."""

from rigs import load_material
from twin.one_setting import bend_answer

metal = load_material("304")
print("304 annealed, 0.075 mm, spot 0.12 mm, absorptivity 0.35, one pass")
for power, speed in ((5.0, 50.0), (10.0, 100.0), (10.0, 200.0), (20.0, 400.0), (60.0, 400.0)):
    answers = [
        bend_answer(metal, 0.075, power, speed, 0.12, absorptivity=0.35, model=model)
        for model in ("fast", "section")
    ]
    angles = [f"{a.angle_deg:5.2f}°" if a.angle_deg is not None else "   – " for a in answers]
    one = answers[1].one
    print(
        f"{power:4.0f} W {speed:4.0f} mm/s   fast {angles[0]}   section {angles[1]}   {one.regime}, "
        f"{one.peak_top_c:.0f} °C on top{'' if answers[1].valid else ', not for folding'}"
    )
