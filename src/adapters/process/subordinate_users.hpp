// Other users for a server that is not root: the numbers that /etc/subuid and /etc/subgid leave to its user,
// or that root gives it.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/simulation_user.hpp>
#include <webots_cloud/transport/folder_meter.hpp>

#include <boost/asio/awaitable.hpp>

#include <filesystem>
#include <memory>
#include <string>

namespace webots_cloud::adapters {

/// A user namespace in which such numbers are users, and the server's user is root. The server stays outside:
/// what it can't do from there to the files of these users, a guard inside does for it.
///
/// Each operation starts a program, on threads of its own, and waits for it for a minute at most; none is
/// cancellable.
/// Thread-safety: one executor.
/// Lifetime: must outlive its operations.
class SubordinateUsers : public FolderMeter
{
public:
    /// The descriptor of the namespace, which exists for as long as this object, or a process in it.
    virtual int user_namespace() const noexcept = 0;

    /// How many users there are: 1 to this number.
    virtual std::uint32_t count() const noexcept = 0;

    /// All folders in `folder`, and it itself, become the server's, so that it can remove everything.
    /// Guards do so when a simulation has ended; this is for those that were killed.
    /// Errors: `unavailable`.
    virtual boost::asio::awaitable<result<>> take_back(std::filesystem::path folder) = 0;

    /// Copies `from`/`file` to `to`/`file`, for the owner of the folder that it gets into. Never through
    /// a link, whatever a simulation does in `to` meanwhile.
    /// Errors: `unavailable`.
    virtual boost::asio::awaitable<result<>> put(std::filesystem::path from, std::filesystem::path to,
                                                 std::string file) = 0;
};

/// Makes the namespace, with the help of newuidmap and newgidmap. Has to be called before this process
/// confines itself.
/// `guard`: the program `webots-process-guard`, absolute.
/// Errors: `start_failed`; `timed_out` after 15 seconds.
boost::asio::awaitable<result<std::shared_ptr<SubordinateUsers>>>
make_subordinate_users(std::filesystem::path guard, SubordinateRange range);

/// The same of a namespace that root has made for the user of a service, by `--pin-users` of the guard, and
/// pinned to this file: 65536 users.
/// Errors: `not_found`: there is no such file; `start_failed`.
result<std::shared_ptr<SubordinateUsers>> open_pinned_users(std::filesystem::path guard,
                                                            std::filesystem::path const& file);

} // namespace webots_cloud::adapters
