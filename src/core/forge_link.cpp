// A link is read from left to right, and the first word that stands for a page of the forge counts: what
// follows are names of the repository's own, which may be any words. So links that were understood before
// other forges were keep their meaning.
#include "forge_link.hpp"

#include "text.hpp"

#include <algorithm>
#include <array>

namespace webots_cloud::core {
namespace {

constexpr unsigned bit(ForgeKind kind) noexcept
{
    return 1u << static_cast<unsigned>(kind);
}

constexpr auto github = bit(ForgeKind::github);
constexpr auto gitlab = bit(ForgeKind::gitlab);
constexpr auto gitea = bit(ForgeKind::gitea);
constexpr auto bitbucket = bit(ForgeKind::bitbucket);
// Which a link may be of if nothing is known of its forge. Others would change what such links mean.
constexpr auto guessed = github | gitlab | gitea | bitbucket;
constexpr auto every = ~0u;

struct Page
{
    std::string_view word;
    LinkView view;
    unsigned forges; ///< Which have it. `blob` and `tree` were always understood, whatever the forge.
};

constexpr std::array pages{
    Page{"blob", LinkView::file, every},
    Page{"tree", LinkView::folder, every},
    Page{"raw", LinkView::file, every},
    Page{"blame", LinkView::file, github | gitlab | gitea},
    Page{"edit", LinkView::file, github | gitlab},
    Page{"src", LinkView::folder, gitea | bitbucket},
    Page{"media", LinkView::file, gitea},
};

Page const* page_of(std::string_view word, unsigned forges) noexcept
{
    auto const* const found = std::find_if(pages.begin(), pages.end(), [&](Page const& page) {
        return page.word == word && page.forges & forges;
    });
    return found == pages.end() ? nullptr : found;
}

/// The parts between slashes, one after the other.
struct Cursor
{
    explicit Cursor(std::string_view text) : path(text) { measure(); }

    void measure() noexcept { size = std::min(path.find('/', begin), path.size()) - begin; }
    bool is_last() const noexcept { return begin + size >= path.size(); }
    void next() noexcept
    {
        begin += size + 1;
        measure();
    }
    std::string_view part() const noexcept { return path.substr(begin, size); }
    std::string_view before() const noexcept { return path.substr(0, begin - 1); }
    std::string_view after() const noexcept
    {
        return is_last() ? std::string_view() : path.substr(begin + size + 1);
    }

    std::string_view path;
    std::size_t begin = 0;
    std::size_t size = 0;
};

std::string_view first_part(std::string_view path) noexcept
{
    return path.substr(0, path.find('/'));
}

std::string_view without_first_part(std::string_view path) noexcept
{
    return path.substr(std::min(first_part(path).size() + 1, path.size()));
}

/// Gitea and Forgejo say what kind of ref follows. Branches win wherever a name is that of a tag, too.
void take_kind_of_ref(ForgeLink& link) noexcept
{
    auto const word = first_part(link.rest);
    if (word != "branch" && word != "tag" && word != "commit")
        return;
    if (word == "tag")
        link.ref_space = "refs/tags/";
    link.rest = without_first_part(link.rest);
}

/// `-` before the word of a page, as only GitLab has it.
Page const* page_after_dash(std::string_view rest) noexcept
{
    return page_of(first_part(rest), gitlab);
}

/// Whether GitLab's mark comes later. There `src` and `media` may be names of groups.
bool has_dash_later(std::string_view rest) noexcept
{
    constexpr std::string_view mark = "/-/";
    if (rest.starts_with(mark.substr(1)) && page_after_dash(rest.substr(mark.size() - 1)))
        return true;
    for (auto at = rest.find(mark); at != std::string_view::npos; at = rest.find(mark, at + 1))
        if (page_after_dash(rest.substr(at + mark.size())))
            return true;
    return false;
}

/// Another host of a forge.
struct OtherHost
{
    std::string_view beginning; ///< Of a link, with the slash before its names.
    std::string_view site;
    bool lacks_view;
};

constexpr std::array other_hosts{
    OtherHost{"https://raw.githubusercontent.com/", "https://github.com", true},
    OtherHost{"https://media.githubusercontent.com/media/", "https://github.com", true},
    OtherHost{"https://raw.github.com/", "https://github.com", true},
    OtherHost{"https://github.dev/", "https://github.com", false},
};

OtherHost const* other_host(std::string_view url) noexcept
{
    auto const* const found =
        std::find_if(other_hosts.begin(), other_hosts.end(),
                     [&](OtherHost const& host) { return url.starts_with(host.beginning); });
    return found == other_hosts.end() ? nullptr : found;
}

/// Where the third part begins; the size of the text when it has none.
std::size_t third_part(std::string_view path) noexcept
{
    auto const first = path.find('/');
    auto const second = first == std::string_view::npos ? first : path.find('/', first + 1);
    return second == std::string_view::npos ? path.size() : second + 1;
}

} // namespace

ForgeKind forge_kind(std::string_view name) noexcept
{
    auto const* const found = std::ranges::find(forge_kinds, name, &ForgeKindRow::name);
    return found == forge_kinds.end() ? ForgeKind::unknown : found->kind;
}

std::optional<ForgeLink> forge_link(std::string_view path, ForgeKind kind) noexcept
{
    constexpr std::size_t first_page = 2; // after an owner and a repository
    bool const is_known = kind != ForgeKind::unknown;
    auto const forges = is_known ? bit(kind) : guessed;
    std::size_t index = 0;
    for (Cursor at(path);; at.next(), ++index) {
        ForgeLink link;
        auto const* page = index < first_page ? nullptr : page_of(at.part(), forges);
        bool const may_be_group = page && !is_known && !(page->forges & gitlab);
        if (may_be_group && has_dash_later(at.after()))
            page = nullptr;
        link.rest = at.after();
        if (page && page->forges & gitea & forges && page->word != "blob" && page->word != "tree")
            take_kind_of_ref(link);
        if (index >= first_page && at.part() == "-" && forges & gitlab) {
            page = page_after_dash(at.after());
            if (!page)
                return std::nullopt; // one of GitLab's other pages
            link.rest = without_first_part(at.after());
        }
        if (page) {
            link.names = at.before();
            link.view = page->view;
            return link;
        }
        bool const has_groups = (forges & gitlab) != 0;
        if (at.is_last() || (index == first_page && !has_groups))
            return std::nullopt;
    }
}

PlacedLink placed_link(std::string_view url) noexcept
{
    PlacedLink link;
    if (auto const* const other = other_host(url)) {
        link.site = other->site;
        link.path = url.substr(other->beginning.size());
        link.lacks_view = other->lacks_view;
        return link;
    }
    constexpr std::string_view mark = "://";
    auto const scheme = url.find(mark);
    auto const host = scheme == std::string_view::npos ? 0 : scheme + mark.size();
    link.site = url.substr(0, url.find('/', host));
    link.path = url.substr(std::min(link.site.size() + 1, url.size()));
    return link;
}

std::optional<ForgeLink> forge_link(PlacedLink const& link) noexcept
{
    if (!link.lacks_view)
        return forge_link(link.path, kind_of_forge(link.site));
    ForgeLink found;
    auto const rest = third_part(link.path);
    found.names = link.path.substr(0, rest == link.path.size() ? rest : rest - 1);
    found.rest = link.path.substr(rest);
    return found;
}

std::string usual_address(std::string_view url)
{
    if (!other_host(url))
        return std::string(url);
    auto const link = placed_link(url);
    auto const rest = third_part(link.path);
    return !link.lacks_view || rest == link.path.size()
               ? concat(link.site, "/", link.path)
               : concat(link.site, "/", link.path.substr(0, rest), "raw/", link.path.substr(rest));
}

} // namespace webots_cloud::core
