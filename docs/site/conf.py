"""How Sphinx builds the documentation as a site: see ./docs.sh, and docs/decisions/014-documentation-site.md for why it is Sphinx.

The source folder is the root of the repository, so each page keeps the path that it has there, and a relative link means the same on
the site, on a forge and in an editor."""
import html
import json
import re
from pathlib import Path

from docutils import nodes
from pygments.lexers.special import TextLexer
from sphinx import addnodes

ROOT = Path(__file__).resolve().parents[2]
HEADERS = 'include/webots_cloud'
MERMAID = ROOT / 'build/node/docs/site/node_modules/@mermaid-js/tiny/dist/mermaid.tiny.js'  # not there without npm

project = 'webots_cloud'
author = 'the authors of webots_cloud'
copyright = author
release = re.search(r'project\(webots_cloud VERSION (\S+)', (ROOT / 'CMakeLists.txt').read_text()).group(1)

root_doc = 'docs/index'
include_patterns = ['*.md', 'docs/**.md', 'examples/**/README.md']
exclude_patterns = ['build', 'log', 'src', 'tests', 'tls', 'website', '**/node_modules']  # large, and without pages

extensions = ['myst_parser']
smartquotes_action = 'q'  # not of dashes: options begin with two
myst_heading_anchors = 4  # headings have the anchors that forges give them

html_theme = 'furo'
# The colours of links, which differ from one release of furo to the next, are those of the API reference.
LINKS = re.findall(r'--link: (#\w+);', Path(__file__).with_name('api.css').read_text())
html_theme_options = {f'{kind}_css_variables': {'color-link': colour, 'color-brand-content': colour}
                      for kind, colour in zip(('light', 'dark'), LINKS)}
html_title = project
html_static_path = ['static', *([str(MERMAID)] if MERMAID.exists() else [])]
html_css_files = ['site.css']
html_extra_path = ['extra']
html_search_scorer = str(Path(__file__).with_name('search_order.js'))
html_copy_source = False
html_show_sphinx = False
pygments_style = 'tango'
pygments_dark_style = 'monokai'


def header_page(path):
    """The page that Doxygen makes of a public header, or of a folder of them, relative to the root of the site."""
    name = Path(path).name
    if path == HEADERS:
        return 'api/index.html'
    return 'api/' + (name.replace('_', '__').replace('.', '_8') + '.html' if name.endswith('.hpp') else 'files.html')


def repository_path(document, target):
    """Where a relative link of a document leads, relative to the root of the repository, or None."""
    path = (ROOT / document).parent.joinpath(target.split('#')[0]).resolve()
    return path.relative_to(ROOT).as_posix() if path.exists() and path.is_relative_to(ROOT) else None


def lead_beyond_pages(app, doctree):
    """Links to public headers, and to folders of them, lead to their pages in the API reference. There are no pages for other folders,
    which are only named. Links to other files offer the file, which Sphinx does by itself."""
    document = app.env.docname
    links = [*doctree.findall(addnodes.download_reference), *(link for link in doctree.findall(addnodes.pending_xref) if link['reftype'] == 'myst')]
    for link in links:
        target = link['reftarget']
        path = repository_path(document, target) or target.lstrip('/')
        if path.startswith(HEADERS):
            up = '../' * document.count('/')
            link.replace_self(nodes.reference('', '', *link.children, refuri=up + header_page(path), internal=True))
        elif (ROOT / path).is_dir() and '#' not in target:
            link.replace_self(link.children)


def keep_diagrams(app, doctree):
    """Diagrams stay as they are written, for the script that draws them in the browser. Without it they are read as text."""
    for block in list(doctree.findall(nodes.literal_block)):
        if block.get('language') == 'mermaid' and MERMAID.exists():
            block.replace_self(nodes.raw('', f'<pre class="mermaid">{html.escape(block.astext())}</pre>', format='html'))


def draw_diagrams(app, page, template, context, doctree):
    """Only pages that have diagrams load the script."""
    if doctree and '<pre class="mermaid">' in context.get('body', ''):
        app.add_js_file(MERMAID.name)
        app.add_js_file('diagrams.js')


def search_from_disk(app, page, template, context, doctree):
    """Only the page of the search loads the script."""
    if page == 'search':
        app.add_js_file('excerpts_from_disk.js')


def keep_texts(app, exception):
    """The texts of all pages, for excerpts_from_disk.js. What Sphinx knows of them at the end is spread over its processes, so the
    pages themselves are read."""
    if exception or app.builder.name != 'html':
        return
    out = Path(app.outdir)
    texts = {}
    for page in app.env.found_docs:
        article = re.search(r'<article role="main"[^>]*>(.*?)</article>', (out / f'{page}.html').read_text(), re.S)
        without_signs = re.sub(r'<a class="headerlink".*?</a>', '', article.group(1), flags=re.S)
        texts[f'{page}.html'] = re.sub(r'\s+', ' ', re.sub(r'<[^>]*>', '', without_signs)).strip()
    (out / '_static/page_texts.js').write_text(f'pageTexts = {json.dumps(texts, ensure_ascii=False)};\n')


def complete_theme(app, exception):
    """Debian's furo (12 and 13) is not bundled as its authors publish it: its script imports another one, which browsers refuse in a page
    that was opened from disk; its style expects a file in the root of the web server, and has lost what makes a page dark for those whose
    system is."""
    if exception or app.builder.name != 'html':
        return
    static = Path(app.outdir) / '_static'
    script = static / 'scripts/furo.js'
    imported = re.match(r'import (?:\* as )?Gumshoe from "\./(.*)";\n', script.read_text())
    if imported:
        script.write_text((script.parent / imported.group(1)).read_text() + script.read_text()[imported.end():])
        for page in Path(app.outdir).rglob('*.html'):
            page.write_text(re.sub(r'<script type="module" (src="[^"]*/furo\.js)', r'<script defer \1', page.read_text()))
    path = static / 'styles/furo.css'
    style = path.read_text()
    imported = re.match(r'@import url\(/javascript/(.*)\);\n', style)
    if imported:
        style = Path('/usr/share/javascript', imported.group(1)).read_text() + style[imported.end():]
    colors = r'(\{[^}]*--color-background-primary[^}]*\})'
    if not re.search(r'prefers-color-scheme: dark\) *\{\s*body[^{]*' + colors, style):
        colors = re.search(r'body\[data-theme="dark"\] *' + colors, style).group(1)
        style += f'@media screen and (prefers-color-scheme: dark) {{ body[data-theme="auto"] {colors} }}\n'
    path.write_text(style)


def setup(app):
    app.add_lexer('mermaid', TextLexer)
    app.connect('doctree-read', lead_beyond_pages)
    app.connect('doctree-read', keep_diagrams)
    app.connect('html-page-context', draw_diagrams)
    app.connect('html-page-context', search_from_disk)
    app.connect('build-finished', complete_theme)
    app.connect('build-finished', keep_texts)
    return {'parallel_read_safe': True, 'parallel_write_safe': True}
