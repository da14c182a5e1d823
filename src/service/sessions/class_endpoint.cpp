// Decisions: core/classes/class_book.
#include "class_endpoint.hpp"

#include "core/text.hpp"

#include <set>

namespace webots_cloud {

namespace asio = boost::asio;
namespace limits = core::class_limits;

ClassEndpoint::ClassEndpoint(LoadMonitor const& monitor, Scheduler& scheduler, Clock& clock, Logger log,
                             ClassEndpointHooks hooks)
    : monitor_(monitor), scheduler_(scheduler), clock_(clock), log_(std::move(log)), hooks_(std::move(hooks)),
      book_(book_hooks())
{}

core::ClassHooks ClassEndpoint::book_hooks()
{
    core::ClassHooks hooks;
    hooks.random = hooks_.random_bytes;
    hooks.free_seats = [this] { return scheduler_.free_seats(clock_.now()); };
    hooks.machines = [this](core::ClassConnection teacher) { return machines_for(teacher); };
    hooks.network = [this](core::ClassConnection teacher) {
        return hooks_.network ? hooks_.network(conversations_.at(teacher).asked) : core::ClassNetwork();
    };
    hooks.simulator_address = [this](std::string_view entry, core::ClassConnection teacher) {
        return hooks_.simulator_address(entry, conversations_.at(teacher).asked);
    };
    hooks.tell_of_guesses = [this](std::string_view what, std::string_view quota_key) {
        warn_of_guesses(what, quota_key);
    };
    return hooks;
}

void ClassEndpoint::set_password(std::string password)
{
    book_.set_password(hooks_.random_bytes ? std::move(password) : std::string());
}

/// Where a project can be fetched beforehand: servers of ours, which are those that count arrivals, but for
/// those that take no sessions, by their own word or the operator's.
std::vector<std::string> ClassEndpoint::machines_for(core::ClassConnection teacher) const
{
    std::set<std::string_view> draining;
    for (auto const& machine : scheduler_.machines(clock_.now()))
        if (machine.refusal == Refusal::draining)
            draining.insert(machine.address);
    std::vector<std::string> machines;
    auto const& asked = conversations_.at(teacher).asked;
    for (auto const& server : monitor_.servers()) {
        bool const is_ours = server.state == ServerState::up && server.report.arrivals.has_value();
        if (is_ours && !draining.contains(server.address) && machines.size() < limits::machines)
            machines.push_back(hooks_.machine_address(server.address, asked));
    }
    return machines;
}

void ClassEndpoint::warn_of_guesses(std::string_view what, std::string_view quota_key) const
{
    if (quota_key.empty())
        log_.warning(LogCause("class guesses"),
                     core::concat("Too many wrong ", what, " were tried: all are refused for a while"));
    else
        log_.warning(LogCause("class guesses", quota_key),
                     core::concat("Too many wrong ", what, " come from ", quota_key,
                                  ", or from all clients together: they are refused for a while"));
}

asio::awaitable<void> ClassEndpoint::serve(ChannelInfo info, Channel& channel)
{
    auto const id = ++last_;
    auto& conversation = conversations_[id];
    conversation.channel = &channel;
    conversation.asked = std::move(info.asked);
    book_.connect(id, std::move(info.quota_key));
    carry_out();
    for (;;) {
        auto const message = co_await channel.receive();
        if (!message)
            break;
        book_.take(id, *message, clock_.now());
        carry_out();
    }
    conversations_.erase(id);
    book_.disconnect(id, clock_.now());
    carry_out();
}

void ClassEndpoint::update()
{
    book_.expire(clock_.now());
    book_.note_ready(hooks_.stage(book_.staging_wishes()));
    carry_out();
}

void ClassEndpoint::stop()
{
    book_.stop();
    carry_out();
}

core::SeatRequest ClassEndpoint::ask_for_seat(std::string_view token, TimePoint now)
{
    if (token.empty())
        return core::SeatRequest::unknown;
    auto const seat = book_.ask_for_seat(token, now);
    carry_out();
    return seat;
}

void ClassEndpoint::take_seat(std::string_view token, core::SeatRequest seat, core::StudentMachine machine,
                              TimePoint now)
{
    book_.take_seat(token, seat, std::move(machine), now);
    carry_out();
}

void ClassEndpoint::carry_out()
{
    for (auto& output : book_.take_output())
        if (auto const found = conversations_.find(output.to); found != conversations_.end())
            send(found->second, std::move(output));
    scheduler_.hold(book_.seats_to_hold());
}

/// A channel whose queue is full drops itself: its browser returns with its key or token.
void ClassEndpoint::send(Conversation const& to, core::ClassOutput output)
{
    if (output.is_picture && to.channel->queued() > limits::queue_before_picture) {
        ++dropped_;
        return;
    }
    relayed_ += output.is_picture ? 1 : 0;
    if (!output.text.empty())
        (void)to.channel->send(std::move(output.text));
    if (output.close_code != 0)
        to.channel->close(output.close_code);
}

} // namespace webots_cloud
