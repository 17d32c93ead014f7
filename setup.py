"""The extension that calls compiled kernels; all else about the package stands in pyproject.toml.

NumPy tells where its headers are only when asked. Without a C compiler the installation does without the extension, and
kernels are interpreted.
"""

import numpy as np
from setuptools import Extension, setup

setup(
    ext_modules=[
        Extension(
            "optsat.kernels._binding",
            ["optsat/kernels/_binding.c"],
            include_dirs=[np.get_include()],
            py_limited_api=True,
            optional=True,
        )
    ]
)
