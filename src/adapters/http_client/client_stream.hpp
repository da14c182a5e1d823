// A connection to a server, plain or encrypted: what Beast and Asio read from and write to.
#pragma once

#include "server_connection.hpp"

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/associated_cancellation_slot.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/core/role.hpp>

#include <array>
#include <cstddef>
#include <memory>
#include <type_traits>
#include <utility>
#include <variant>

namespace webots_cloud::adapters {

/// One type for both kinds of stream, which knows nothing of its callers: so the compiler writes algorithms,
/// such as those of a WebSocket, once, and the layers below them not anew for each algorithm. Without it
/// beast_websocket.cpp takes 47 s and 1.5 GB.
///
/// The handlers of its operations are called from the event loop of the executor; an executor that is
/// associated with one of them does not count.
///
/// Lifetime: must outlive its operations.   Thread-safety: one executor.
class ClientStream
{
public:
    using executor_type = boost::asio::any_io_executor;
    using Error = boost::beast::error_code;

    /// Plain without `tls`.
    ClientStream(executor_type const& executor, boost::asio::ssl::context* tls);

    executor_type get_executor() { return lowest().get_executor(); }

    PlainStream& lowest() noexcept;

    /// Null unless it is encrypted.
    EncryptedStream* encrypted() noexcept { return std::get_if<EncryptedStream>(&stream_); }

    // As Asio asks of a stream. Cancellation: as that of the stream within.
    template<class Buffers, class Token>
    auto async_read_some(Buffers const& buffers, Token&& token)
    {
        return boost::asio::async_initiate<Token, void(Error, std::size_t)>(
            [this](auto&& handler, boost::asio::mutable_buffer buffer) {
                read(buffer, Waiting(std::forward<decltype(handler)>(handler)));
            },
            token, first_of(buffers));
    }
    template<class Buffers, class Token>
    auto async_write_some(Buffers const& buffers, Token&& token)
    {
        return boost::asio::async_initiate<Token, void(Error, std::size_t)>(
            [this](auto&& handler, Gathered const& gathered) {
                write(gathered, Waiting(std::forward<decltype(handler)>(handler)));
            },
            token, Gathered(buffers));
    }

    // As Beast asks of what is under a WebSocket.
    template<class Handler>
    friend void async_teardown(boost::beast::role_type role, ClientStream& stream, Handler&& handler)
    {
        stream.tear_down(role, Waiting(std::forward<Handler>(handler)));
    }
    friend void beast_close_socket(ClientStream& stream) { stream.lowest().close(); }

private:
    /// Who waits for an operation.
    class Waiting
    {
    public:
        using cancellation_slot_type = boost::asio::cancellation_slot;

        template<class Handler>
        requires(!std::is_same_v<std::decay_t<Handler>, Waiting>) explicit Waiting(Handler&& handler)
            : slot_(boost::asio::get_associated_cancellation_slot(handler)),
              call_(std::make_unique<CallOf<std::decay_t<Handler>>>(std::forward<Handler>(handler)))
        {}

        cancellation_slot_type get_cancellation_slot() const noexcept { return slot_; }

        /// Once.
        void operator()(Error error, std::size_t size = 0) { call_.release()->complete(error, size); }

    private:
        struct Call
        {
            virtual ~Call() = default;
            /// Deletes itself before it calls the handler, as Asio has it.
            virtual void complete(Error error, std::size_t size) = 0;
        };
        template<class Handler>
        struct CallOf final : Call
        {
            explicit CallOf(Handler its) : handler(std::move(its)) {}
            void complete(Error error, std::size_t size) override
            {
                auto called = std::move(handler);
                delete this;
                if constexpr (std::is_invocable_v<Handler&, Error, std::size_t>)
                    called(error, size);
                else
                    called(error);
            }
            Handler handler;
        };

        cancellation_slot_type slot_;
        std::unique_ptr<Call> call_;
    };

    /// The buffers that one write takes: a frame's header and its payload, and what surrounds them.
    class Gathered
    {
    public:
        using value_type = boost::asio::const_buffer;
        using const_iterator = value_type const*;

        template<class Buffers>
        explicit Gathered(Buffers const& buffers)
        {
            auto each = boost::asio::buffer_sequence_begin(buffers);
            auto const end = boost::asio::buffer_sequence_end(buffers);
            for (; each != end && count_ < buffers_.size(); ++each)
                if (boost::asio::const_buffer const buffer(*each); buffer.size() > 0)
                    buffers_[count_++] = buffer;
        }

        const_iterator begin() const noexcept { return buffers_.data(); }
        const_iterator end() const noexcept { return begin() + count_; }

    private:
        std::array<value_type, 4> buffers_;
        std::size_t count_ = 0;
    };

    template<class Buffers>
    static boost::asio::mutable_buffer first_of(Buffers const& buffers)
    {
        auto const end = boost::asio::buffer_sequence_end(buffers);
        for (auto each = boost::asio::buffer_sequence_begin(buffers); each != end; ++each)
            if (boost::asio::mutable_buffer const buffer(*each); buffer.size() > 0)
                return buffer;
        return {};
    }

    void read(boost::asio::mutable_buffer buffer, Waiting waiting);
    void write(Gathered const& buffers, Waiting waiting);
    void tear_down(boost::beast::role_type role, Waiting waiting);

    std::variant<std::monostate, PlainStream, EncryptedStream> stream_;
};

} // namespace webots_cloud::adapters
