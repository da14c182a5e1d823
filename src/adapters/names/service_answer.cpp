#include "service_answer.hpp"

#include "core/text.hpp"

#include <arpa/nameser.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

namespace webots_cloud::adapters {

using core::concat;

result<NameAnswer> services_of(std::string const& name, std::span<unsigned char const> answer)
{
    auto const senseless = [&] {
        return Failure(errc::protocol_error,
                       concat("the answer for the name ", core::printable(name, 255), " makes no sense"));
    };
    ns_msg message{};
    if (::ns_initparse(answer.data(), static_cast<int>(answer.size()), &message) != 0)
        return senseless();
    NameAnswer named;
    auto ttl = std::chrono::seconds::max();
    for (int i = 0; i < ns_msg_count(message, ns_s_an); ++i) {
        ns_rr record{};
        if (::ns_parserr(&message, ns_s_an, i, &record) != 0)
            return senseless();
        if (ns_rr_type(record) != ns_t_srv || ns_rr_class(record) != ns_c_in)
            continue;
        auto const* const data = ns_rr_rdata(record);
        constexpr int numbers = 6; // bytes, RFC 2782: priority, weight, port
        std::array<char, NS_MAXDNAME> target{};
        if (ns_rr_rdlen(record) <= numbers ||
            ::ns_name_uncompress(ns_msg_base(message), ns_msg_end(message), data + numbers, target.data(),
                                 target.size()) < 0)
            return senseless();
        NamedService service;
        service.priority = static_cast<std::uint16_t>(ns_get16(data));
        service.weight = static_cast<std::uint16_t>(ns_get16(data + 2));
        service.port = static_cast<std::uint16_t>(ns_get16(data + 4));
        service.target = target.data();
        named.services.push_back(std::move(service));
        ttl = std::min(ttl, std::chrono::seconds(ns_rr_ttl(record)));
    }
    named.ttl = named.services.empty() ? Duration::zero() : Duration(ttl);
    return named;
}

} // namespace webots_cloud::adapters
