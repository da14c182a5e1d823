// Which simulation servers there are: those of the configuration, those that names stand for, and those that
// announce themselves.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/fleet.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/name_service.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_set>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Optional callbacks of a MachineDiscovery, and what announcements need. None of them may block.
struct MachineDiscoveryHooks
{
    MachineDiscoveryHooks() = default;

    /// Called by `run` when there are other machines than before, with what is different, one after the
    /// other, for Fleet::change. Of many machines it is called several times, each time for some, in
    /// different turns of the event loop.
    std::function<void(std::vector<ServerChange> const& changes)> changed;
    /// The addresses of machines that can't be reached: then those of the next priority of a service are
    /// used. Empty: those of the first are.
    std::function<std::unordered_set<std::string>()> unreachable;
    /// Signs announcements (HMAC-SHA256, with a secret that the machines know). Empty: none is accepted.
    std::function<std::string(std::string_view message)> mac;
    /// So many machines may announce themselves, 10,000 at most. Each that is polled takes a descriptor.
    std::size_t max_announced = 10'000;
    /// What announcements have to name: letters of base64url that nobody can guess, others in each run, so
    /// that one which was made for another session server, or before a restart, counts for nothing here.
    std::string receiver;
};

/// Looks names up again and again, and listens to announcements (docs/discovery.md).
///
/// The machines change in `run`, which looks after them once a second.
/// Lifetime: everything passed by reference must outlive it. It must outlive its operations: await their end
/// before it is destroyed.
/// Thread-safety: one executor.
class MachineDiscovery
{
public:
    /// `entries`: as in "simulationServers". The address of one may be `dns:<name>:<port>` or
    /// `srv:<service>`: in its place come the machines that the name stands for, which are treated as the
    /// entry says. One of the address `announced` says how those are treated that announce themselves.
    /// `internal_address` of such an entry is `http`, `https` or `https://<name>`: its machines get an
    /// internal address each, and a path of their own (`ServerSpec::has_own_path`).
    ///
    /// `loopback`: names and announcements may lead to this machine itself, by its loopback addresses.
    MachineDiscovery(std::vector<ServerSpec> entries, bool loopback, NameService& names, Clock& clock,
                     Logger log, MachineDiscoveryHooks hooks = MachineDiscoveryHooks());
    ~MachineDiscovery();

    /// Takes other entries: `servers` has the new entries at once, and all changes that nobody was told of
    /// yet, which nobody is told of any more. What is known of names that stay, and of announced machines,
    /// stays. Does nothing if they are those that it has.
    void apply(std::vector<ServerSpec> entries, bool loopback);

    /// The machines as `changed` has told, for Fleet::set. Of equal addresses the first one counts.
    std::vector<ServerSpec> servers() const;

    /// Answers an announcement: `POST /api/machines` (protocol section 13.17).
    HttpResponse take_announcement(IncomingRequest const& request);

    /// Cancellation: terminal.
    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> run();

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace webots_cloud
