# Pages of the Python package, from its docstrings: scripts/build_reference.sh
project = "pliant"
author = "the developers of pliant"
extensions = ["sphinx.ext.autodoc"]
autodoc_member_order = "bysource"
autodoc_typehints = "none"
html_theme = "alabaster"
html_theme_options = {"description": "From a recording of a soft object to an elastic model", "page_width": "1100px", "fixed_sidebar": True}
html_show_sphinx = False
html_copy_source = False
autodoc_mock_imports = ["jax", "torch"]
