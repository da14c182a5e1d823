// Looks at the queue and the nodes of the cluster at intervals, one question for all jobs, and ends our jobs
// that no simulation belongs to any more. slurm_runtime.cpp starts jobs.
// Decisions: core/slurm/cluster_tables.
#include <webots_cloud/slurm_mode.hpp>

#include "core/refusals.hpp"
#include "core/simulation/simulator_environment.hpp"
#include "core/slurm/cluster_tables.hpp"
#include "core/slurm/job_command.hpp"
#include "core/text.hpp"
#include "service/run_program.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

constexpr auto program_limit = std::chrono::seconds(30); // Slurm's programs ask again for ten seconds or more

/// A name that is one already.
bool is_numeric(std::string_view address)
{
    bool const is_v4 = address.find_first_not_of("0123456789.") == std::string_view::npos;
    return !address.empty() && (is_v4 || address.find(':') != std::string_view::npos);
}

} // namespace

struct SlurmMode::Impl
{
    Impl(SlurmConfig wanted, SlurmFacts found, ProcessHost& host, Clock& time, Logger logger)
        : config(std::move(wanted)), facts(std::move(found)), processes(host), clock(time),
          log(std::move(logger))
    {}

    asio::awaitable<result<std::string>> run(std::filesystem::path program,
                                             std::vector<std::string> arguments);
    asio::awaitable<result<>> find_partitions();
    asio::awaitable<result<>> look_at_nodes();
    asio::awaitable<result<>> look_at_jobs();
    asio::awaitable<void> look();
    asio::awaitable<void> end_left_overs(std::vector<std::string> known);
    asio::awaitable<void> end(std::vector<std::string> jobs);
    core::Environment environment() const;

    SlurmConfig config;
    SlurmFacts const facts;
    ProcessHost& processes;
    Clock& clock;
    Logger log;
    std::vector<core::ClusterNode> nodes;
    core::ClusterLoad load;
    std::vector<core::QueuedJob> queue;
    std::vector<std::string> jobs; ///< That we have.
    /// Whether Slurm may have jobs of this server that the server no longer has.
    bool may_have_left_overs = false;
    bool answers = true; ///< When it was asked last.
    std::uint64_t turn = 0;
};

core::Environment SlurmMode::Impl::environment() const
{
    core::Environment wanted;
    for (auto const& variable : facts.environment)
        if (variable.first == "SLURM_CONF")
            wanted.push_back(variable);
    return wanted;
}

asio::awaitable<result<std::string>> SlurmMode::Impl::run(std::filesystem::path program,
                                                          std::vector<std::string> arguments)
{
    ProcessSpec spec;
    spec.environment = environment();
    for (std::string_view const name : {"PATH", "HOME"})
        core::set_variable(spec.environment, name, core::value_of(facts.environment, name));
    spec.environment.emplace_back("SLURM_TIME_FORMAT", core::slurm_time_format);
    spec.argv = std::move(arguments);
    spec.argv.insert(spec.argv.begin(), program.native());
    co_return co_await run_program(processes, clock, std::move(spec), program_limit);
}

/// Which partition is Slurm's default, and whether all that the operator names are there.
asio::awaitable<result<>> SlurmMode::Impl::find_partitions()
{
    auto const printed = co_await run(facts.sinfo, core::partition_arguments());
    if (!printed)
        co_return Failure(errc::unavailable, concat("Slurm does not answer: ", printed.error().message()));
    auto const partitions = core::parse_partitions(*printed);
    core::name_partitions(config, partitions.standard);
    for (auto const& name : core::partitions_of(config)) {
        if (name.empty())
            co_return Failure(errc::not_found, "Slurm has no default partition: name one with "
                                               "\"partition\" of \"launcher\".");
        if (std::ranges::find(partitions.names, name) == partitions.names.end())
            co_return Failure(errc::not_found,
                              concat("Slurm has no partition \"", name,
                                     "\" that this server's user may use: see \"launcher\"."));
    }
    co_return result<>();
}

asio::awaitable<result<>> SlurmMode::Impl::look_at_nodes()
{
    auto const printed = co_await run(facts.sinfo, core::node_arguments(core::partitions_of(config)));
    if (!printed)
        co_return printed.error();
    nodes = core::parse_nodes(*printed);
    load = core::load_of_nodes(nodes);
    co_return result<>();
}

/// One question for all jobs, also those of others, among which ours wait.
asio::awaitable<result<>> SlurmMode::Impl::look_at_jobs()
{
    auto const known = jobs; // jobs that come meanwhile may not be in the table
    auto const printed = co_await run(facts.squeue, core::queue_arguments(core::partitions_of(config)));
    if (!printed)
        co_return printed.error();
    queue = core::parse_queue(*printed);
    auto known_now = jobs;
    known_now.insert(known_now.end(), known.begin(), known.end());
    bool const has_left_overs = !core::strangers(queue, facts.identity, known_now).empty();
    // A job that came or went while the table was made may be in it or not: then the next one tells.
    may_have_left_overs = has_left_overs || known != jobs;
    if (has_left_overs)
        co_await end_left_overs(std::move(known_now));
    co_return result<>();
}

/// Other users of the cluster can name their jobs as ours are named, and forge rows of the table of all. So
/// what is ended is looked up among our own.
asio::awaitable<void> SlurmMode::Impl::end_left_overs(std::vector<std::string> known)
{
    auto const printed = co_await run(facts.squeue, core::own_queue_arguments(core::partitions_of(config)));
    if (!printed)
        co_return;
    known.insert(known.end(), jobs.begin(), jobs.end()); // some may have come meanwhile
    auto left = core::strangers(core::parse_queue(*printed), facts.identity, known);
    if (!left.empty())
        co_await end(std::move(left));
}

asio::awaitable<void> SlurmMode::Impl::end(std::vector<std::string> left)
{
    log.info(LogCause("left-overs"), concat("Slurm: ends ", std::to_string(left.size()),
                                            " jobs of this server that nobody waits for"));
    auto const ended = co_await run(facts.scancel, core::cancel_arguments(std::move(left)));
    if (!ended)
        log.warning(LogCause("left-overs"), concat("Slurm: jobs can't be ended: ", ended.error().message()));
}

asio::awaitable<void> SlurmMode::Impl::look()
{
    auto looked = co_await look_at_nodes();
    if (looked && (!jobs.empty() || may_have_left_overs))
        looked = co_await look_at_jobs();
    if (!looked && std::exchange(answers, false))
        log.warning(LogCause("slurm"), concat("Slurm does not answer: ", looked.error().message()));
    if (looked && !std::exchange(answers, true))
        log.info(LogCause("slurm"), "Slurm answers again");
}

SlurmMode::SlurmMode(SlurmConfig config, SlurmFacts facts, ProcessHost& processes, Clock& clock, Logger log)
    : impl_(std::make_unique<Impl>(std::move(config), std::move(facts), processes, clock, std::move(log)))
{}

SlurmMode::~SlurmMode() = default;

asio::awaitable<result<>> SlurmMode::open()
{
    auto const& config = impl_->config;
    auto const& facts = impl_->facts;
    for (auto const& [name, program] :
         {std::pair<std::string_view, std::filesystem::path>("srun", facts.srun),
          {"scancel", facts.scancel},
          {"squeue", facts.squeue},
          {"sinfo", facts.sinfo}})
        if (program.empty())
            co_return Failure(errc::not_found,
                              concat(name, " is not installed, which \"launcher\" needs (slurm-client)."));
    if (!config.copy_to.empty() && facts.tar.empty())
        co_return Failure(errc::not_found, "tar is not installed, which \"copyTo\" of \"launcher\" needs.");
    // All that can be wrong is asked now, so that the operator is told at the start, and not the first
    // browser.
    auto found = co_await impl_->find_partitions();
    if (!found)
        co_return found;
    found = co_await impl_->look_at_nodes();
    if (found)
        found = co_await impl_->look_at_jobs();
    if (!found)
        co_return Failure(errc::unavailable, concat("Slurm does not answer: ", found.error().message()));
    auto const partitions = core::partitions_of(config);
    impl_->log.info(concat("Simulations are jobs of Slurm, in ",
                           core::join({partitions.begin(), partitions.end()}, ", "), ": ",
                           std::to_string(impl_->nodes.size()), " nodes, ",
                           std::to_string(impl_->load.processors), " processors"));
    co_return result<>();
}

asio::awaitable<result<>> SlurmMode::run()
{
    for (;;) {
        auto const waited = co_await impl_->clock.wait_until(impl_->clock.now() + impl_->config.interval);
        if (!waited)
            co_return waited;
        co_await impl_->look();
    }
}

SlurmConfig const& SlurmMode::config() const noexcept
{
    return impl_->config;
}

SlurmFacts const& SlurmMode::facts() const noexcept
{
    return impl_->facts;
}

std::string SlurmMode::new_job(std::string_view label)
{
    auto name =
        concat(impl_->facts.identity, impl_->facts.run, "_", label, "_", std::to_string(++impl_->turn));
    impl_->jobs.push_back(name);
    return name;
}

void SlurmMode::forget(std::string const& name) noexcept
{
    impl_->may_have_left_overs = std::erase(impl_->jobs, name) > 0 || impl_->may_have_left_overs;
}

std::string SlurmMode::news_of(std::string_view name) const
{
    if (!impl_->answers)
        return "Waiting for a free node of the cluster, whose scheduler does not answer at the moment.";
    return core::waiting_text(impl_->queue, name, impl_->clock.wall());
}

core::Environment SlurmMode::environment() const
{
    return impl_->environment();
}

asio::awaitable<result<std::string>> SlurmMode::address_of(std::string node)
{
    auto const found = std::ranges::find(impl_->nodes, node, &core::ClusterNode::name);
    auto const address = found == impl_->nodes.end() ? std::string() : found->address;
    if (is_numeric(address))
        co_return address;
    std::string_view first;
    result<std::string> printed;
    if (!address.empty()) {
        std::vector<std::string> arguments{"ahosts", address};
        printed = co_await impl_->run(impl_->facts.getent, std::move(arguments));
        first = printed ? core::split(*printed, ' ').front() : first;
    }
    if (!is_numeric(first))
        co_return core::refused(core::Refused::node_without_address, {{"node", core::printable(node, 60)}});
    co_return std::string(first);
}

namespace {

/// What the partitions have left, in the place of this machine's processors and memory: session servers place
/// by that. Everything else, such as the disk, is the machine's.
class PartitionMetrics final : public HostMetrics
{
public:
    PartitionMetrics(HostMetrics& machine, core::ClusterLoad const& load) : machine_(machine), load_(load) {}

    HostSample sample() override
    {
        auto sample = machine_.sample();
        // Counters, whose growth since the last sample is the share that jobs have. Without any node that can
        // take jobs, everything is taken.
        busy_ += load_.processors > 0 ? load_.allocated : 1;
        total_ += load_.processors > 0 ? load_.processors : 1;
        sample.cpu_busy = busy_;
        sample.cpu_total = total_;
        sample.share_busy = 0;
        sample.share_total = 0;
        sample.memory_used = load_.memory_used;
        sample.swap_used = 0;
        sample.gpu.reset();
        return sample;
    }

    HostDescription description() override
    {
        auto description = machine_.description();
        description.processor = "the nodes of Slurm";
        description.cores = static_cast<int>(load_.processors);
        description.threads_per_core = 1;
        description.memory_bytes = load_.memory << 20;
        description.gpu.clear();
        return description;
    }

private:
    HostMetrics& machine_;
    core::ClusterLoad const& load_;
    std::uint64_t busy_ = 0;
    std::uint64_t total_ = 0;
};

} // namespace

std::unique_ptr<HostMetrics> SlurmMode::metrics(HostMetrics& machine) const
{
    return std::make_unique<PartitionMetrics>(machine, impl_->load);
}

} // namespace webots_cloud
