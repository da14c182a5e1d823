// Looks through the plain folders of forges for worlds, which are in
// `<owner>/<repository>/[<folder>/]worlds`. The operator may have put links to owners and repositories into
// them; what projects consist of is somebody's, and links there are not followed.
#include "adapters/threads/blocking_pool.hpp"
#include "project_world.hpp"

#include "core/projects/lesson.hpp"
#include "core/projects/world_info.hpp"
#include "core/safe_names.hpp"
#include "core/text.hpp"
#include "core/web_form.hpp"

#include <webots_cloud/adapters/projects.hpp>

#include <algorithm>
#include <fstream>
#include <map>
#include <set>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using core::concat;

constexpr std::size_t most_worlds = 200;
constexpr std::size_t most_entries = 20'000; // of folders: a second or so on a slow disk
constexpr int deepest = 3;                   // folders between a repository and `worlds`

/// At most so many bytes of a file; none where there is no such file.
std::string first_bytes(fs::path const& file, std::size_t limit)
{
    std::ifstream stream(file, std::ios::binary);
    std::string beginning(limit, '\0');
    stream.read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
    beginning.resize(static_cast<std::size_t>(stream.gcount()));
    return beginning;
}

bool is_regular(fs::path const& file)
{
    std::error_code failed;
    return fs::symlink_status(file, failed).type() == fs::file_type::regular;
}

/// One search.
class WorldSearch
{
public:
    /// What was found, and by its folder what is wrong with the name of a project.
    struct Outcome
    {
        std::vector<FoundWorld> worlds;
        std::map<std::string, std::string> unnameable;
    };

    Outcome run(std::vector<ForgeConfig> const& forges)
    {
        for (auto const& forge : forges) {
            forge_ = forge.url;
            for (auto const& owner : folders_in(forge.directory, Links::followed))
                for (auto const& repository : folders_in(owner, Links::followed))
                    search(repository, repository, 0);
        }
        return std::move(outcome_);
    }

private:
    enum class Links
    {
        followed,
        left_out
    };

    /// Without hidden ones, in the order of their names.
    std::vector<fs::path> entries_of(fs::path const& folder)
    {
        std::vector<fs::path> entries;
        std::error_code failed;
        for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end;
             entry.increment(failed)) {
            if (++seen_ > most_entries)
                break;
            auto const name = entry->path().filename().string();
            if (!name.starts_with('.') && core::is_safe_file_name(name))
                entries.push_back(entry->path());
        }
        std::ranges::sort(entries);
        return entries;
    }

    std::vector<fs::path> folders_in(fs::path const& folder, Links links)
    {
        auto folders = entries_of(folder);
        std::erase_if(folders, [links](fs::path const& entry) {
            std::error_code failed;
            bool const is_link = links == Links::left_out && fs::is_symlink(entry, failed);
            return is_link || !fs::is_directory(entry, failed);
        });
        return folders;
    }

    void search(fs::path const& repository, fs::path const& folder, int depth)
    {
        for (auto const& inner : folders_in(folder, Links::left_out)) {
            if (inner.filename() == "worlds")
                add_worlds(repository, inner);
            else if (depth < deepest)
                search(repository, inner, depth + 1);
        }
    }

    void add_worlds(fs::path const& repository, fs::path const& worlds)
    {
        if (!core::is_published(adapters::read_webots_yml(worlds.parent_path())))
            return;
        for (auto const& file : entries_of(worlds)) {
            if (outcome_.worlds.size() < most_worlds && file.extension() == ".wbt" && is_regular(file))
                add(repository, file);
        }
    }

    void add(fs::path const& repository, fs::path const& file)
    {
        auto const beginning = first_bytes(file, core::world_info_bytes);
        if (beginning.empty())
            return;
        auto url = concat(forge_, "/", repository.parent_path().filename().string(), "/",
                          repository.filename().string(), "/blob/main");
        for (auto const& part : file.lexically_relative(repository))
            url += concat("/", core::percent_encode(part.string()));
        // Who lists a world promises that it can be started.
        if (auto const named = parse_world_url(url, {ForgeAddress(forge_)}); !named) {
            outcome_.unnameable.emplace(repository.string(), named.error().message());
            return;
        }
        auto info = core::world_info(beginning);
        auto& found = outcome_.worlds.emplace_back();
        found.forge = forge_;
        found.world.url = std::move(url);
        found.world.title = std::move(info.title);
        found.world.text = std::move(info.text);
        add_lesson(found.world, core::lesson_file(file.string()));
    }

    static void add_lesson(ListedWorld& world, fs::path const& file)
    {
        if (!is_regular(file))
            return;
        auto lesson = core::parse_lesson(first_bytes(file, core::largest_lesson + 1));
        if (!lesson)
            return; // whoever starts it is told why
        world.titles = std::move(lesson->title);
        world.texts = std::move(lesson->about);
    }

    std::string forge_;
    Outcome outcome_;
    std::size_t seen_ = 0;
};

class PlainWorldFinder final : public WorldFinder
{
public:
    PlainWorldFinder(std::vector<ForgeConfig> forges, Logger log)
        : forges_(std::move(forges)), log_(std::move(log)),
          pool_(1, adapters::BlockingPool::Priority::background)
    {}

    asio::awaitable<std::vector<FoundWorld>> find() override
    {
        auto work = [forges = forges_] { return WorldSearch().run(forges); };
        auto outcome = co_await pool_.run(std::move(work));
        for (auto const& [folder, why] : outcome.unnameable)
            if (told_.size() < most_worlds && told_.insert(folder).second)
                log_.warning(
                    concat("The worlds in ", folder, " are not listed: ", why, ". Rename the folder."));
        co_return std::move(outcome.worlds);
    }

private:
    std::vector<ForgeConfig> forges_;
    Logger log_;
    std::set<std::string> told_;
    adapters::BlockingPool pool_;
};

} // namespace

std::unique_ptr<WorldFinder> make_world_finder(std::vector<ForgeConfig> forges, Logger log)
{
    std::erase_if(forges, [](ForgeConfig const& forge) { return forge.is_server(); });
    return std::make_unique<PlainWorldFinder>(std::move(forges), std::move(log));
}

} // namespace webots_cloud
