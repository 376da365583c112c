"""Jobs that tests write, as TOML, and their cutter."""

MILL = """[[cutter]]
number = 1
diameter_mm = 10.0
flutes = 2
helix_deg = 30.0
flute_length_mm = 20.0
overhang_mm = 30.0
modulus_gpa = 580.0
runout_mm = 0.0
"""


def block_job(file: str, low: str, high: str, rest: str, keys: str = "") -> str:
    """A program on ``vmc`` in a block in layers of 1 mm; ``rest`` follows its table, ``keys`` are of [program]."""
    stock = f"[stock]\nlow_mm = {low}\nhigh_mm = {high}\nlayer_mm = 1.0\n"
    return f'[program]\nfile = "{file}"\n{keys}[machine]\nname = "vmc"\n{stock}{rest}'


def simulation(limits: str) -> str:
    """Material, cutter and operation of a simulation in steps of 2 mm."""
    operation = '[[operation]]\nkind = "simulate"\nstep_mm = 2.0\n'
    return f'[material]\nname = "al7075-t6"\n{MILL}{operation}[limits]\n{limits}'


def made_up_job(flutes: int, step_mm: float, rest: str) -> str:
    """A straight-fluted cutter in a block of the material ``m.toml``; ``rest`` goes on in the operation."""
    return f"""[program]
file = "a.ngc"
[machine]
name = "vmc"
[stock]
low_mm = [0.0, -20.0, -6.0]
high_mm = [40.0, 20.0, 0.0]
layer_mm = 1.5
[material]
file = "m.toml"
[[cutter]]
number = 1
diameter_mm = 10.0
flutes = {flutes}
helix_deg = 0.0
flute_length_mm = 20.0
overhang_mm = 30.0
modulus_gpa = 580.0
[[operation]]
kind = "simulate"
step_mm = {step_mm}
tolerance_mm = 0.002
{rest}"""


def made_up_material(*coefficients: float) -> str:
    """Ktc, Krc, Kac [MPa], Kte, Kre, Kae [N/mm] of ``m.toml``."""
    keys = ("ktc_mpa", "krc_mpa", "kac_mpa", "kte_n_mm", "kre_n_mm", "kae_n_mm")
    lines = [f"{key} = {value}\n" for key, value in zip(keys, coefficients, strict=True)]
    head = 'name = "made up"\nworkpiece = "none"\nsource = "made up for this test"\nconditions = "none"\n'
    return head + "".join(lines)
