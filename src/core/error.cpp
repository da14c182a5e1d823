#include <webots_cloud/error.hpp>

namespace webots_cloud {
namespace {

class Category final : public boost::system::error_category
{
public:
    char const* name() const noexcept override { return "webots_cloud"; }

    std::string message(int code) const override
    {
        switch (static_cast<errc>(code)) {
        case errc::invalid_argument:
            return "a parameter is unusable";
        case errc::invalid_config:
            return "the configuration is unusable";
        case errc::invalid_url:
            return "the address can't be understood";
        case errc::refused:
            return "refused by the operator's policy";
        case errc::unavailable:
            return "nothing is available at the moment";
        case errc::not_found:
            return "not found";
        case errc::unreachable:
            return "the peer can't be reached";
        case errc::timed_out:
            return "the peer took too long";
        case errc::too_large:
            return "larger than its limit";
        case errc::protocol_error:
            return "the peer's answer makes no sense";
        case errc::start_failed:
            return "the simulator could not be started";
        case errc::closed:
            return "the other side has gone";
        }
        return "unknown error";
    }
};

} // namespace

boost::system::error_category const& webots_cloud_category() noexcept
{
    static Category const category;
    return category;
}

boost::system::error_code make_error_code(errc code) noexcept
{
    return {static_cast<int>(code), webots_cloud_category()};
}

} // namespace webots_cloud
