"""HTML pages that need nothing but themselves: templates, charts as SVG, style, script."""
