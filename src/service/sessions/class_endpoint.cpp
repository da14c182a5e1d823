// Decisions: core/classes/class_book, core/classes/class_simulators.
#include "class_endpoint.hpp"

#include "core/access/site_access.hpp"
#include "core/classes/class_simulators.hpp"
#include "core/text.hpp"

#include <set>

namespace webots_cloud {

namespace asio = boost::asio;
namespace limits = core::class_limits;

ClassEndpoint::ClassEndpoint(SiteContext const& site, ClassStager& stager)
    : site_(site), stager_(stager), book_(book_hooks())
{
    apply();
}

void ClassEndpoint::apply()
{
    book_.set_password(site_.hooks.random_bytes ? site_.config.service.teacher_password : std::string());
}

core::ClassHooks ClassEndpoint::book_hooks()
{
    core::ClassHooks hooks;
    hooks.random = site_.hooks.random_bytes;
    hooks.free_seats = [this] { return site_.scheduler.free_seats(site_.clock.now()); };
    hooks.machines = [this](core::ClassConnection teacher) { return machines_for(teacher); };
    hooks.network = [this](core::ClassConnection teacher) {
        return network_of(conversations_.at(teacher).asked);
    };
    hooks.simulator_address = [this](std::string_view entry, core::ClassConnection teacher) {
        return site_.addresses.address_of(entry, conversations_.at(teacher).asked);
    };
    hooks.tell_of_guesses = [this](std::string_view what, std::string_view quota_key) {
        warn_of_guesses(what, quota_key);
    };
    return hooks;
}

/// Only for those who have asked this machine by a name that it has for itself: others have a link for
/// students, and need not know its networks.
core::ClassNetwork ClassEndpoint::network_of(AskedAddress const& asked) const
{
    core::ClassNetwork network;
    if (!site_.hooks.shared_addresses || core::reach_of(asked.host) != core::Reach::this_machine)
        return network;
    network.addresses = site_.hooks.shared_addresses();
    network.is_open = site_.config.address.host == core::asked_name;
    return network;
}

/// Where a project can be fetched beforehand: servers of ours, which are those that count arrivals, but for
/// those that take no sessions, by their own word or the operator's.
std::vector<std::string> ClassEndpoint::machines_for(core::ClassConnection teacher) const
{
    std::set<std::string_view> draining;
    for (auto const& machine : site_.scheduler.machines(site_.clock.now()))
        if (machine.refusal == Refusal::draining)
            draining.insert(machine.address);
    std::vector<std::string> machines;
    auto const& asked = conversations_.at(teacher).asked;
    for (auto const& server : site_.monitor.servers()) {
        bool const is_ours = server.state == ServerState::up && server.report.arrivals.has_value();
        if (is_ours && !draining.contains(server.address) && machines.size() < limits::machines)
            machines.push_back(site_.machine_address(server.address, asked));
    }
    return machines;
}

void ClassEndpoint::warn_of_guesses(std::string_view what, std::string_view quota_key) const
{
    if (quota_key.empty())
        site_.log.warning(LogCause("class guesses"),
                          core::concat("Too many wrong ", what, " were tried: all are refused for a while"));
    else
        site_.log.warning(LogCause("class guesses", quota_key),
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
        book_.take(id, *message, site_.clock.now());
        carry_out();
    }
    conversations_.erase(id);
    book_.disconnect(id, site_.clock.now());
    carry_out();
}

void ClassEndpoint::update()
{
    book_.expire(site_.clock.now());
    book_.note_ready(stager_.update(book_.staging_wishes()));
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

void ClassEndpoint::take_seat(std::string_view token, core::SeatRequest seat, std::string_view entry,
                              AskedAddress const& asked, TimePoint now)
{
    book_.take_seat(token, seat, core::student_machine(entry, site_.addresses, asked), now);
    carry_out();
}

void ClassEndpoint::write_metrics(core::MetricsText& text) const
{
    auto const figures = book_.figures();
    text.family(core::metric("classes")).add(static_cast<double>(figures.classes));
    text.family(core::metric("class_students")).add(static_cast<double>(figures.students));
    text.family(core::metric("class_seats_held")).add(static_cast<double>(figures.seats_held));
    text.family(core::metric("class_pictures_total"))
        .add(static_cast<double>(relayed_), {{"result", "relayed"}})
        .add(static_cast<double>(dropped_), {{"result", "dropped"}});
}

void ClassEndpoint::carry_out()
{
    for (auto& output : book_.take_output())
        if (auto const found = conversations_.find(output.to); found != conversations_.end())
            send(found->second, std::move(output));
    site_.scheduler.hold(book_.seats_to_hold());
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
