// Asks the kernel whether somebody listens on a port of our network.
#pragma once

namespace webots_cloud::guard {

/// How long to wait before the next look for something that has been waited for since `waited_ms`: an eighth
/// of that, from 1 to 250 ms. So who is waited for is found at most an eighth too late, after few looks: 60
/// in the first ten seconds.
int pause_between_looks(long waited_ms);

/// Asks for sockets of one TCP port that listen (sock_diag), and for no others: a look takes microseconds,
/// whatever the number of connections.
class ListenerQuestion
{
public:
    enum class Answer
    {
        no,
        yes,
        unknown ///< The kernel does not say.
    };

    explicit ListenerQuestion(int port);
    ListenerQuestion(ListenerQuestion const&) = delete;
    ~ListenerQuestion();

    Answer ask();

private:
    Answer ask(unsigned char family);

    int port_;
    int kernel_;
};

} // namespace webots_cloud::guard
