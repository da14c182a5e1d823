// For servers that speak only the older versions of git's protocol. libgit2 knows the protocol; the network
// is ours (git2_transport.cpp), and so is what becomes of the pack (git_pack_reader.cpp), so all limits hold.
#include "git2_client.hpp"

#include "core/git/git_problem.hpp"
#include "core/refusals.hpp"
#include "core/text.hpp"

#include <git2.h>
#include <git2/sys/odb_backend.h>
#include <git2/sys/repository.h>

#include <algorithm>

namespace webots_cloud::adapters {
namespace {

using core::concat;

/// Starts libgit2 once for the process, blind to the configuration of the machine and its users.
void start_libgit2()
{
    static int const started = [] {
        auto const count = git_libgit2_init();
        for (auto const level : {GIT_CONFIG_LEVEL_PROGRAMDATA, GIT_CONFIG_LEVEL_SYSTEM, GIT_CONFIG_LEVEL_XDG,
                                 GIT_CONFIG_LEVEL_GLOBAL})
            git_libgit2_opts(GIT_OPT_SET_SEARCH_PATH, level, "");
        return count;
    }();
    (void)started;
}

/// What libgit2 has just complained about.
Failure libgit2_failure()
{
    auto const* const last = git_error_last();
    std::string_view words = last && last->message ? last->message : "no reason given";
    constexpr std::string_view remote = "remote error: ";
    if (words.starts_with(remote))
        return core::git_server_error(words.substr(remote.size()));
    return {core::GitProblem::malformed,
            concat("the git server does not answer as one: ", core::printable(core::trim(words), 200))};
}

core::GitObjectId object_id(git_oid const& from)
{
    core::GitObjectId id;
    std::copy_n(from.id, id.bytes.size(), id.bytes.begin());
    return id;
}

template<auto Free>
struct FreeWith
{
    template<class T>
    void operator()(T* object) const noexcept
    {
        Free(object);
    }
};

/// Where a pack goes instead of into the repository.
struct PackTarget
{
    GitPackReader* pack = nullptr;
    GitClient::Progress const* progress = nullptr;
    std::uint64_t received = 0;
};

/// Takes a pack as libgit2 hands it on.
struct PackWriter : git_odb_writepack
{
    PackWriter(Git2Transport& transport_of_it, PackTarget& target_of_it, git_odb_backend* owner)
        : git_odb_writepack{}, transport(transport_of_it), target(target_of_it)
    {
        backend = owner;
        append = [](git_odb_writepack* self, void const* bytes, size_t size, git_indexer_progress*) {
            return static_cast<PackWriter*>(self)->on_append({static_cast<char const*>(bytes), size});
        };
        commit = [](git_odb_writepack* self, git_indexer_progress*) {
            auto& writer = *static_cast<PackWriter*>(self);
            return writer.transport.attempt([&] { return writer.target.pack->finish(); });
        };
        free = [](git_odb_writepack* self) { delete static_cast<PackWriter*>(self); };
    }

    int on_append(std::string_view bytes)
    {
        return transport.attempt([&] {
            target.received += bytes.size();
            auto pushed = target.pack->push(bytes);
            (*target.progress)(*target.pack, target.received);
            return pushed;
        });
    }

    Git2Transport& transport;
    PackTarget& target;
};

/// An object database that has nothing and keeps nothing: libgit2's own takes the memory that a delta claims,
/// and what it stores would have to be read and written once more.
struct NoDatabase : git_odb_backend
{
    NoDatabase(Git2Transport& transport_of_it, PackTarget& target_of_it)
        : git_odb_backend{}, transport(transport_of_it), target(target_of_it)
    {
        git_odb_init_backend(this, GIT_ODB_BACKEND_VERSION);
        writepack = [](git_odb_writepack** out, git_odb_backend* self, git_odb*, git_indexer_progress_cb,
                       void*) {
            auto& database = *static_cast<NoDatabase*>(self);
            return database.transport.attempt([&]() -> result<> {
                if (!database.target.pack)
                    return Failure(core::GitProblem::malformed,
                                   "the git server sends what it was not asked for");
                *out = new PackWriter(database.transport, database.target, self);
                return {};
            });
        };
        free = [](git_odb_backend* self) { delete static_cast<NoDatabase*>(self); };
    }

    Git2Transport& transport;
    PackTarget& target;
};

} // namespace

/// libgit2's objects.
class Git2Client::Session
{
public:
    explicit Session(Git2Transport& transport) : transport_(transport) {}

    result<> open(std::string const& folder)
    {
        git_repository_init_options options;
        git_repository_init_options_init(&options, GIT_REPOSITORY_INIT_OPTIONS_VERSION);
        options.flags = GIT_REPOSITORY_INIT_BARE | GIT_REPOSITORY_INIT_NO_REINIT | GIT_REPOSITORY_INIT_MKDIR;
        git_repository* repository = nullptr;
        if (git_repository_init_ext(&repository, folder.c_str(), &options) < 0)
            return no_room();
        repository_.reset(repository);
        // libgit2 1.5 leaks some ten kilobytes for each entry of the configuration that it looks at.
        git_config* no_entries = nullptr;
        if (git_config_new(&no_entries) < 0)
            return no_room();
        configuration_.reset(no_entries);
        if (git_repository_set_config(repository, no_entries) < 0)
            return no_room();
        git_odb* database = nullptr;
        if (git_odb_new(&database) < 0)
            return no_room();
        database_.reset(database);
        auto nothing = std::make_unique<NoDatabase>(transport_, target_);
        if (git_odb_add_backend(database, nothing.get(), 1) < 0)
            return no_room();
        nothing.release();
        if (git_repository_set_odb(repository, database) < 0)
            return no_room();
        git_remote* remote = nullptr;
        if (git_remote_create_anonymous(&remote, repository, transport_.remote().url.c_str()) < 0)
            return outcome(-1);
        remote_.reset(remote);
        return {};
    }

    result<> connect()
    {
        auto const callbacks = this->callbacks();
        return outcome(git_remote_connect(remote_.get(), GIT_DIRECTION_FETCH, &callbacks, nullptr, nullptr));
    }

    /// The refs, each annotated tag as what it points to.
    result<std::vector<core::GitRef>> refs()
    {
        git_remote_head const** heads = nullptr;
        std::size_t count = 0;
        if (auto const listed = outcome(git_remote_ls(&heads, &count, remote_.get())); !listed)
            return listed.error();
        constexpr std::string_view peeled = "^{}";
        std::vector<core::GitRef> refs;
        for (std::size_t i = 0; i < count; ++i) {
            std::string_view const name = heads[i]->name;
            // An annotated tag is followed by what it points to.
            if (name.ends_with(peeled)) {
                if (!refs.empty() && refs.back().name == name.substr(0, name.size() - peeled.size()))
                    refs.back().id = object_id(heads[i]->oid);
                continue;
            }
            core::GitRef ref;
            ref.name = name;
            ref.id = object_id(heads[i]->oid);
            refs.push_back(std::move(ref));
        }
        return refs;
    }

    result<> download(std::string ref, PackTarget target)
    {
        target_ = target;
        char* name = ref.data();
        git_strarray const list{&name, 1};
        git_fetch_options options;
        git_fetch_options_init(&options, GIT_FETCH_OPTIONS_VERSION);
        options.callbacks = callbacks();
        options.download_tags = GIT_REMOTE_DOWNLOAD_TAGS_NONE;
        options.follow_redirects = GIT_REMOTE_REDIRECT_NONE;
        auto const downloaded = outcome(git_remote_download(remote_.get(), &list, &options));
        target_ = PackTarget();
        return downloaded;
    }

private:
    git_remote_callbacks callbacks()
    {
        git_remote_callbacks callbacks;
        git_remote_init_callbacks(&callbacks, GIT_REMOTE_CALLBACKS_VERSION);
        callbacks.transport = Git2Transport::connect;
        callbacks.payload = &transport_;
        return callbacks;
    }

    result<> outcome(int code)
    {
        if (code >= 0)
            return {};
        return transport_.failure ? *transport_.failure : libgit2_failure();
    }

    static Failure no_room() { return core::refused(core::Refused::no_room_for_repository); }

    Git2Transport& transport_;
    PackTarget target_;
    std::unique_ptr<git_repository, FreeWith<git_repository_free>> repository_;
    std::unique_ptr<git_config, FreeWith<git_config_free>> configuration_;
    std::unique_ptr<git_odb, FreeWith<git_odb_free>> database_;
    std::unique_ptr<git_remote, FreeWith<git_remote_free>> remote_;
};

Git2Client::Git2Client(CurlHttp& http, GitRemote remote, CurlLimits limits, GitIncoming scratch)
    : scratch_(std::move(scratch)), transport_(http, std::move(remote), limits)
{}

Git2Client::~Git2Client() = default;

result<> Git2Client::connect()
{
    if (session_)
        return {};
    start_libgit2();
    auto session = std::make_unique<Session>(transport_);
    if (auto const opened = session->open((scratch_.folder() / "repository").string()); !opened)
        return opened.error();
    if (auto const connected = session->connect(); !connected)
        return connected.error();
    auto refs = session->refs();
    if (!refs)
        return refs.error();
    refs_ = std::move(*refs);
    session_ = std::move(session);
    return {};
}

result<std::vector<core::GitRef>> Git2Client::ls_refs()
{
    if (auto const connected = connect(); !connected)
        return connected.error();
    return refs_;
}

std::uint64_t Git2Client::memory_of_refs() const noexcept
{
    constexpr std::uint64_t each = 256; // here and in libgit2
    constexpr std::uint64_t copies = 3;
    std::uint64_t bytes = 0;
    for (auto const& ref : refs_)
        bytes += each + copies * ref.name.size();
    return bytes;
}

result<> Git2Client::fetch(core::GitObjectId const& commit, bool shallow, GitPackReader& pack,
                           GitClient::Progress const& progress)
{
    if (auto const connected = connect(); !connected)
        return connected.error();
    PackTarget target;
    target.pack = &pack;
    target.progress = &progress;
    transport_.shallow = shallow;
    // A server of the older versions gives what a ref points to, and nothing else.
    auto const ref =
        std::find_if(refs_.begin(), refs_.end(), [&](core::GitRef const& each) { return each.id == commit; });
    if (ref == refs_.end())
        return Failure(core::GitProblem::no_such_commit);
    return session_->download(ref->name, target);
}

} // namespace webots_cloud::adapters
