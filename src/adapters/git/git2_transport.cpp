// libgit2 writes a request and then reads an answer, as if from a file. A second thread receives the answer
// meanwhile, by our own HTTP, because libgit2's has no deadlines.
#include "git2_transport.hpp"

#include "git_pipe.hpp"

#include "core/git/git_pkt_line.hpp"
#include "core/git/git_problem.hpp"
#include "core/refusals.hpp"
#include "core/text.hpp"

#include <git2.h>
#include <git2/sys/transport.h>

#include <atomic>
#include <memory>
#include <thread>

namespace webots_cloud::adapters {
namespace {

using core::concat;

Failure no_frame()
{
    return {core::GitProblem::malformed, "the git server sent a frame without a length"};
}

Failure not_carried_out(std::exception const& failed)
{
    return core::refused(core::Refused::not_fetched, {{"words", failed.what()}});
}

/// The length of the frame that `bytes` begin with: 0 of a flush, nothing until four digits are there.
result<std::optional<std::size_t>> frame_length(std::string_view bytes)
{
    constexpr std::size_t digits = 4;
    if (bytes.size() < digits)
        return std::optional<std::size_t>();
    std::size_t length = 0;
    for (char const digit : bytes.substr(0, digits)) {
        auto const value = std::string_view("0123456789abcdef").find(digit);
        if (value == std::string_view::npos)
            return no_frame();
        length = length * 16 + value;
    }
    if (length != 0 && length < digits)
        return no_frame();
    return std::optional(length);
}

/// One request: libgit2 writes its body and then reads the answer, which another thread receives meanwhile.
class Stream : public git_smart_subtransport_stream
{
public:
    Stream(Git2Transport& transport, git_smart_subtransport* parent, bool asks_for_refs)
        : git_smart_subtransport_stream{}, transport_(transport), asks_for_refs_(asks_for_refs)
    {
        subtransport = parent;
        read = [](git_smart_subtransport_stream* self, char* buffer, size_t size, size_t* count) {
            return static_cast<Stream*>(self)->on_read(buffer, size, *count);
        };
        write = [](git_smart_subtransport_stream* self, char const* bytes, size_t size) {
            return static_cast<Stream*>(self)->on_write({bytes, size});
        };
        free = [](git_smart_subtransport_stream* self) { delete static_cast<Stream*>(self); };
    }

    ~Stream()
    {
        abandoned_ = true;
        pipe_.leave();
        if (receiver_.joinable())
            receiver_.join();
    }

private:
    int on_write(std::string_view bytes)
    {
        return transport_.attempt([&]() -> result<> {
            request_.append(bytes);
            return {};
        });
    }

    int on_read(char* buffer, std::size_t size, std::size_t& count)
    {
        return transport_.attempt([&]() -> result<> {
            if (!receiver_.joinable())
                if (auto const started = start(); !started)
                    return started.error();
            auto const received = pipe_.read(buffer, size);
            if (!received)
                return received.error();
            count = *received;
            return {};
        });
    }

    result<> start()
    {
        if (!asks_for_refs_ && transport_.shallow) {
            auto request = make_shallow(request_);
            if (!request)
                return request.error();
            request_ = std::move(*request);
        }
        receiver_ = std::thread([this] { receive(); });
        return {};
    }

    void receive() noexcept
    {
        result<> outcome;
        try {
            outcome = exchange();
        } catch (std::exception const& failed) {
            outcome = not_carried_out(failed);
        }
        pipe_.end(std::move(outcome));
    }

    result<> exchange()
    {
        auto limits = transport_.limits();
        limits.abandoned = &abandoned_;
        if (asks_for_refs_)
            limits.bytes = max_git_ref_bytes;
        GitClient client(transport_.http(), transport_.remote(), limits);
        if (asks_for_refs_)
            return client.advertise([this](std::string_view bytes) { return pipe_.write(bytes); });
        GitAnswerStart answer;
        return client.post(request_, [&](std::string_view bytes) -> result<> {
            auto const passed = answer.push(bytes);
            return passed ? pipe_.write(*passed) : result<>(passed.error());
        });
    }

    Git2Transport& transport_;
    bool asks_for_refs_;
    std::string request_;
    std::atomic<bool> abandoned_{false};
    GitPipe pipe_;
    std::thread receiver_;
};

/// Makes a stream for each of libgit2's requests.
class Subtransport : public git_smart_subtransport
{
public:
    explicit Subtransport(Git2Transport& transport) : git_smart_subtransport{}, transport_(transport)
    {
        action = [](git_smart_subtransport_stream** out, git_smart_subtransport* self, char const*,
                    git_smart_service_t service) {
            return static_cast<Subtransport*>(self)->open(*out, service);
        };
        close = [](git_smart_subtransport*) { return 0; };
        free = [](git_smart_subtransport* self) { delete static_cast<Subtransport*>(self); };
    }

private:
    int open(git_smart_subtransport_stream*& out, git_smart_service_t service)
    {
        return transport_.attempt([&]() -> result<> {
            if (service != GIT_SERVICE_UPLOADPACK_LS && service != GIT_SERVICE_UPLOADPACK)
                return Failure(core::GitProblem::malformed, "nothing is ever pushed");
            out = new Stream(transport_, this, service == GIT_SERVICE_UPLOADPACK_LS);
            return {};
        });
    }

    Git2Transport& transport_;
};

int make_subtransport(git_smart_subtransport** out, git_transport*, void* transport)
{
    auto& self = *static_cast<Git2Transport*>(transport);
    return self.attempt([&]() -> result<> {
        *out = new Subtransport(self);
        return {};
    });
}

} // namespace

int Git2Transport::connect(git_transport** out, git_remote* owner, void* self)
{
    git_smart_subtransport_definition definition{};
    definition.callback = make_subtransport;
    definition.rpc = 1; // each request is one of its own
    definition.param = self;
    return git_transport_smart(out, owner, &definition);
}

int Git2Transport::attempt(std::function<result<>()> const& work) noexcept
{
    result<> outcome;
    try {
        outcome = work();
    } catch (std::exception const& failed) {
        outcome = not_carried_out(failed); // libgit2 is C: nothing may be thrown through it
    }
    if (outcome)
        return 0;
    if (!failure)
        failure = outcome.error();
    return GIT_EUSER;
}

result<std::string> make_shallow(std::string_view request)
{
    for (std::size_t at = 0; at < request.size();) {
        auto const length = frame_length(request.substr(at));
        if (!length || !*length)
            break;
        if (**length == 0)
            return concat(request.substr(0, at), core::pkt_line("deepen 1\n"), request.substr(at));
        at += **length;
    }
    return Failure(core::GitProblem::malformed, "the request has no end of its wants");
}

result<std::string> GitAnswerStart::push(std::string_view bytes)
{
    if (passed_)
        return std::string(bytes);
    waiting_.append(bytes);
    for (;;) {
        auto const length = frame_length(waiting_);
        if (!length)
            return length.error();
        if (!*length || waiting_.size() < **length)
            return std::string();
        constexpr std::size_t digits = 4;
        auto const size = std::max(digits, **length);
        auto const is_flush = **length == 0;
        auto const text = std::string_view(waiting_).substr(0, size).substr(digits);
        if (auto const fine = check_for_git_error(text); !fine)
            return fine.error();
        auto const is_shallow = text.starts_with("shallow ");
        passed_ = !is_shallow;
        if (is_flush || is_shallow)
            waiting_.erase(0, size);
        if (passed_)
            return std::move(waiting_);
    }
}

} // namespace webots_cloud::adapters
