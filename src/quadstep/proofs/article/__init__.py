"""The paper as an article: `quadstep explain` writes it; its figures fly the laws of the package."""
