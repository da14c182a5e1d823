// What differs where simulations run as users of /etc/subuid, whose files the server can neither write nor
// remove: a guard, which runs as such a user, does it.
#include "subordinate_source.hpp"

#include "adapters/files/remove_tree.hpp"
#include "adapters/threads/blocking_pool.hpp"

#include <webots_cloud/adapters/secrets.hpp>

#include <filesystem>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace webots_cloud::adapters {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;

result<> make_private_folder(fs::path const& folder)
{
    std::error_code failed;
    fs::create_directory(folder, failed);
    if (!failed)
        fs::permissions(folder, fs::perms::owner_all, failed);
    return failed ? result<>(Failure(errc::unavailable, failed.message())) : result<>();
}

/// Files by way of a folder of the server's, from where a guard copies them.
class SubordinateTexts final : public TextFiles
{
public:
    SubordinateTexts(TextFiles& files, std::shared_ptr<SubordinateUsers> users, fs::path scratch)
        : files_(files), users_(std::move(users)), scratch_(std::move(scratch))
    {}

    asio::awaitable<result<TextsRead>> read(fs::path folder, std::vector<std::string> names) override
    {
        return files_.read(std::move(folder), std::move(names));
    }

    asio::awaitable<result<std::vector<TextFile>>> read_all(fs::path folder, TextLimits limits) override
    {
        return files_.read_all(std::move(folder), limits);
    }

    asio::awaitable<result<>> write(fs::path folder, std::vector<TextFile> files) override
    {
        auto const scratch = scratch_ / ("written-" + make_token());
        auto make = [scratch, files] { return make_folders_for(scratch, files); };
        auto written = co_await pool_.run(std::move(make));
        if (written)
            written = co_await files_.write(scratch, files);
        for (auto file = files.begin(); written && file != files.end(); ++file) {
            auto name = file->name;
            written = co_await users_->put(scratch, folder, std::move(name));
        }
        auto remove = [scratch] { return remove_tree(scratch); };
        (void)co_await pool_.run(std::move(remove)); // else the next start of the server does it
        co_return written;
    }

private:
    static result<> make_folders_for(fs::path const& scratch, std::vector<TextFile> const& files)
    {
        auto made = make_private_folder(scratch);
        for (auto file = files.begin(); made && file != files.end(); ++file) {
            std::error_code failed;
            fs::create_directories((scratch / file->name).parent_path(), failed);
            if (failed)
                made = Failure(errc::unavailable, failed.message());
        }
        return made;
    }

    TextFiles& files_;
    std::shared_ptr<SubordinateUsers> users_;
    fs::path scratch_;
    BlockingPool pool_{1};
};

/// Puts files back by way of a folder of the server's, and removes what a killed guard has not given back.
class SubordinateSource final : public ProjectSource
{
public:
    SubordinateSource(ProjectSource& source, std::shared_ptr<SubordinateUsers> users, fs::path scratch)
        : source_(source), users_(std::move(users)), scratch_(std::move(scratch))
    {}

    asio::awaitable<result<FetchedProject>> fetch(FetchOrder order) override
    {
        return source_.fetch(std::move(order));
    }

    asio::awaitable<result<std::vector<ListedWorld>>> list_worlds(FetchOrder order) override
    {
        return source_.list_worlds(std::move(order));
    }

    asio::awaitable<result<std::string>> current_revision(ProjectRef project) override
    {
        return source_.current_revision(std::move(project));
    }

    RefMeaning ref_meaning() const noexcept override { return source_.ref_meaning(); }

    bool is_local() const noexcept override { return source_.is_local(); }

    std::vector<std::uint32_t> cached() const override { return source_.cached(); }

    asio::awaitable<result<>> restore(RestoreOrder order) override
    {
        auto const scratch = scratch_ / ("restored-" + make_token());
        auto make = [scratch] { return make_private_folder(scratch); };
        auto restored = co_await pool_.run(std::move(make));
        auto const root = std::exchange(order.root, scratch);
        auto file = order.file;
        if (restored)
            restored = co_await source_.restore(std::move(order));
        if (restored)
            restored = co_await users_->put(scratch, root, std::move(file));
        auto remove = [scratch] { return remove_tree(scratch); };
        (void)co_await pool_.run(std::move(remove)); // else the next start of the server does it
        co_return restored;
    }

    asio::awaitable<result<>> discard(fs::path directory) override
    {
        auto removed = co_await source_.discard(directory);
        if (removed)
            co_return removed;
        if (auto const taken = co_await users_->take_back(directory); !taken)
            co_return removed;
        auto remove = [directory] { return remove_tree(directory); };
        co_return co_await pool_.run(std::move(remove));
    }

private:
    ProjectSource& source_;
    std::shared_ptr<SubordinateUsers> users_;
    fs::path scratch_;
    BlockingPool pool_{1};
};

} // namespace

std::unique_ptr<ProjectSource>
for_subordinate_users(ProjectSource& source, std::shared_ptr<SubordinateUsers> users, fs::path scratch)
{
    return std::make_unique<SubordinateSource>(source, std::move(users), std::move(scratch));
}

std::unique_ptr<TextFiles> for_subordinate_users(TextFiles& files, std::shared_ptr<SubordinateUsers> users,
                                                 fs::path scratch)
{
    return std::make_unique<SubordinateTexts>(files, std::move(users), std::move(scratch));
}

} // namespace webots_cloud::adapters
