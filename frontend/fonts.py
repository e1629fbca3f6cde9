"""Makes the fonts that ship with the package: `python frontend/fonts.py`, with fonttools, brotli and npm.

Inter, of all weights that pages use as WOFF2 and regular as TrueType for Matplotlib, and STIX Two Math for formulas, cut down
to the signs that pages, figures and formulas use. The same packages give the same bytes. Not needed to build or to install.
"""

import subprocess
import tarfile
import tempfile
from pathlib import Path

from fontTools.subset import Options, Subsetter
from fontTools.ttLib import TTFont
from fontTools.varLib.instancer import instantiateVariableFont

FONTS = Path(__file__).parents[1] / "src" / "quadstep" / "report" / "fonts"

PACKAGES = {
    "inter-ui@4.1.1": ("Inter", "variable/InterVariable.woff2", "LICENSE.txt"),
    "@fontsource/stix-two-math@5.3.0": ("STIX Two Math", "files/stix-two-math-latin-400-normal.woff2", "LICENSE"),
}
"""Of npm: name, font and licence."""

LATIN = [*range(0x20, 0x7F), *range(0xA0, 0x180)]
GREEK = [*range(0x391, 0x3AA), *range(0x3B1, 0x3CA), 0x3F5]
TEXT = "\u0302\u0303\u0307\u0308‐‑–—‘’“”„†•…‰′″‹›⁄€™←↑→↓↔⇒∂∆∏∑−√∞∫≈≠≤≥✓✗⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺₀₁₂₃₄₅₆₇₈₉\u2007\u2009\u202f"
MATHS = "ℓℎ∈∓⋯⇔⇒≻≪≫∘‖⟨⟩→←⃛…′∂∗∑∏∫−√∞≈≠≤≥⋅∀∃∇˙ˆ˜¯"
ITALIC = [*range(0x1D434, 0x1D468), *range(0x1D6E2, 0x1D71C)]
"""What browsers make of letters in formulas."""


def cut(font: TTFont, signs: list[int], features: list[str]) -> TTFont:
    """The font with these signs alone."""
    options = Options(layout_features=features, hinting=False, notdef_outline=True, name_IDs=[0, 1, 2, 3, 4, 5, 6, 13, 14])
    subsetter = Subsetter(options)
    subsetter.populate(unicodes=signs)
    subsetter.subset(font)
    return again(font)


def again(font: TTFont) -> TTFont:
    """The font as it is read from its file."""
    with tempfile.TemporaryDirectory() as folder:
        font.flavor = None
        font.save(Path(folder) / "font.ttf")
        return TTFont(Path(folder) / "font.ttf", recalcTimestamp=False, lazy=False)


def save(font: TTFont, name: str) -> None:
    """As WOFF2 or TrueType, by its ending."""
    font.flavor = "woff2" if name.endswith("woff2") else None
    font.save(FONTS / name)


def main() -> None:
    """Write all of them and LICENSES.txt."""
    found, licences = {}, []
    with tempfile.TemporaryDirectory() as folder:
        for package, (name, font, licence) in PACKAGES.items():
            told = subprocess.run(["npm", "pack", "--silent", package], cwd=folder, check=True, capture_output=True, text=True)
            with tarfile.open(Path(folder) / told.stdout.split()[-1]) as archive:
                archive.extractall(folder, filter="data")
            root = Path(folder) / "package"
            found[name] = TTFont(root / font, recalcTimestamp=False, lazy=False)
            text = (root / licence).read_text(encoding="utf-8").strip()
            licences.append(f"{name}, from the package {package}, cut down to the signs in use\n\n{text}\n")
    inter = cut(found["Inter"], [*LATIN, *GREEK, *map(ord, TEXT)], ["kern", "mark", "mkmk", "ccmp", "tnum", "cv05", "cv11"])
    save(instantiateVariableFont(again(inter), {"opsz": 14, "wght": (400, 700)}), "inter.woff2")
    for number, name in ((1, "Inter"), (4, "Inter Regular"), (6, "Inter-Regular")):
        inter["name"].setName(name, number, 3, 1, 0x409)
    save(instantiateVariableFont(inter, {"opsz": 14, "wght": 400}), "inter.ttf")
    maths = cut(found["STIX Two Math"], [*LATIN, *GREEK, *ITALIC, *map(ord, MATHS)], ["kern", "ccmp", "ssty", "dtls", "flac"])
    save(maths, "math.woff2")
    (FONTS / "LICENSES.txt").write_text(f"\n{'-' * 80}\n\n".join(licences), encoding="utf-8")


if __name__ == "__main__":
    main()
