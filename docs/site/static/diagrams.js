// Draws the diagrams of a page, in colours that are read on the light ground which site.css gives them.
mermaid.initialize({ startOnLoad: true, theme: 'neutral' });
