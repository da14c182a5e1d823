// Git LFS: pointers, what a server says of their content, and where that may be fetched from.
#include "unit_test.hpp"

#include "core/access/public_networks.hpp"
#include "core/git/git_lfs_address.hpp"
#include "core/git/git_lfs_batch.hpp"
#include "core/git/git_lfs_pointer.hpp"

#include <string>
#include <vector>

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(git_lfs)

namespace {

std::string const object(64, 'a');
std::string const other(64, 'b');
std::string const version = "version https://git-lfs.github.com/spec/v1\n";
std::string const oid = "oid sha256:" + object + "\n";
std::string const forge = "https://forge.org";

std::vector<LfsPointer> two_pointers()
{
    std::vector<LfsPointer> pointers(2);
    pointers[0].object = object;
    pointers[0].size = 5;
    pointers[1].object = other;
    pointers[1].size = 7;
    return pointers;
}

std::string answer_of(std::string const& id, int size, std::string const& rest)
{
    return R"({"oid":")" + id + R"(","size":)" + std::to_string(size) + "," + rest + "}";
}

std::string download(std::string const& href, std::string const& header = "{}")
{
    return R"("actions":{"download":{"href":")" + href + R"(","header":)" + header + R"(,"expires_in":60}})";
}

std::string batch(std::string const& objects)
{
    return R"({"transfer":"basic","objects":[)" + objects + "]}";
}

std::string why(std::string const& answer)
{
    auto const parsed = parse_lfs_batch(answer, two_pointers());
    return parsed ? "" : parsed.error().message();
}

} // namespace

BOOST_AUTO_TEST_CASE(a_pointer_is_understood_in_all_spellings_that_git_lfs_knows)
{
    for (auto const& text :
         {version + oid + "size 12345\n", version + oid + "size 12345",
          "version https://git-lfs.github.com/spec/v1\r\noid sha256:" + object + "\r\nsize 12345\r\n",
          "version https://hawser.github.com/spec/v1\n" + oid + "size 12345\n",
          "version http://git-media.io/v/2\n" + oid + "size 12345\n",
          "\n" + version + "\n" + oid + "\nsize 12345\n\n"}) {
        auto const pointer = parse_lfs_pointer(text);
        BOOST_TEST_CONTEXT(text)
        {
            BOOST_TEST_REQUIRE(pointer.has_value());
            BOOST_TEST(pointer->object == object);
            BOOST_TEST(pointer->size == 12345u);
            BOOST_TEST(!pointer->extended);
        }
    }
}

BOOST_AUTO_TEST_CASE(a_pointer_with_extensions_says_so)
{
    auto const pointer = parse_lfs_pointer(version + "ext-0-zip sha256:" + other + "\n" + oid + "size 1\n");
    BOOST_TEST_REQUIRE(pointer.has_value());
    BOOST_TEST(pointer->extended);
    BOOST_TEST(pointer->object == object);
}

BOOST_AUTO_TEST_CASE(everything_else_is_a_file_as_any_other)
{
    std::string const short_oid = "oid sha256:" + object.substr(1) + "\n";
    for (auto const& text : {std::string(),
                             std::string(500, 'x'),
                             version,
                             version + oid,
                             version + "size 1\n" + oid,
                             oid + version + "size 1\n",
                             version + short_oid + "size 1\n",
                             version + oid + "size -1\n",
                             version + oid + "size 1.5\n",
                             version + oid + "size 007\n",
                             version + oid + "size 99999999999999999999\n",
                             version + oid + "size 9223372036854775808\n",
                             version + oid + "size \n",
                             version + oid + "size 1\nmore x\n",
                             version + "oid md5:" + object + "\nsize 1\n",
                             version + "oid sha256:" + std::string(64, 'A') + "\nsize 1\n",
                             version + "ext-x-zip sha256:" + other + "\n" + oid + "size 1\n",
                             "x" + version + oid + "size 1\n",
                             "version https://git-lfs.github.com/spec/v2\n" + oid + "size 1\n",
                             version + oid + "size 1" + std::string(1024, '\n')})
        BOOST_TEST(!parse_lfs_pointer(text).has_value(), text);
    BOOST_TEST(parse_lfs_pointer(version + oid + "size 9223372036854775807").has_value());
}

BOOST_AUTO_TEST_CASE(every_cut_of_a_pointer_is_none_or_one_of_a_smaller_file)
{
    auto const text = version + oid + "size 12345";
    for (std::size_t size = 0; size < text.size(); ++size) {
        auto const pointer = parse_lfs_pointer(text.substr(0, size));
        BOOST_TEST((!pointer || pointer->size < 12345u), size);
    }
}

BOOST_AUTO_TEST_CASE(a_question_names_every_object)
{
    BOOST_TEST(lfs_batch_request(two_pointers()) ==
               R"({"operation":"download","transfers":["basic"],"objects":[{"oid":")" + object +
                   R"(","size":5},{"oid":")" + other + R"(","size":7}],"hash_algo":"sha256"})");
}

BOOST_AUTO_TEST_CASE(an_answer_is_given_in_the_order_of_the_question)
{
    auto const answers = parse_lfs_batch(
        batch(answer_of(other, 7, download("https://cdn.org/b")) + "," +
              answer_of(object, 5,
                        download("https://cdn.org/a", R"({"Authorization":"Basic x","X-Amz-A":"1"})"))),
        two_pointers());
    BOOST_TEST_REQUIRE(answers.has_value());
    BOOST_TEST((*answers)[0].address == "https://cdn.org/a");
    BOOST_TEST((*answers)[0].headers == (std::vector<std::string>{"Authorization: Basic x", "X-Amz-A: 1"}),
               boost::test_tools::per_element());
    BOOST_TEST((*answers)[1].address == "https://cdn.org/b");
}

BOOST_AUTO_TEST_CASE(what_is_not_to_be_had_says_why_without_control_characters)
{
    auto const answers = parse_lfs_batch(
        batch(answer_of(object, 5, R"("error":{"code":404,"message":"not\u001b here "})")), two_pointers());
    BOOST_TEST_REQUIRE(answers.has_value());
    BOOST_TEST((*answers)[0].address == "");
    BOOST_TEST((*answers)[0].error == 404);
    BOOST_TEST((*answers)[0].words == "not\\x1b here");
    BOOST_TEST((*answers)[1].address == ""); // the answer does not mention it
    BOOST_TEST((*answers)[1].error == 0);
}

BOOST_AUTO_TEST_CASE(answers_that_make_no_sense_say_what_is_wrong)
{
    auto const good = download("https://cdn.org/a");
    for (auto const* const text : {"", "null", "[]", "{", "<html>", "{\"objects\":[}"})
        BOOST_TEST(why(text) == "sends no JSON", text);
    BOOST_TEST(why(std::string(100'000, '[')) == "sends no JSON");
    BOOST_TEST(why("{}") == "sends no objects");
    BOOST_TEST(why(R"({"objects":{}})") == "sends no objects");
    BOOST_TEST(why(R"({"transfer":"ssh","objects":[]})") == "wants a transfer that was not asked for");
    BOOST_TEST(why(batch("{},{},{}")) == "sends more objects than it was asked for");
    BOOST_TEST(why(batch("1")) == "sends an object that it was not asked for");
    BOOST_TEST(why(batch(answer_of(std::string(64, 'c'), 5, good))) ==
               "sends an object that it was not asked for");
    BOOST_TEST(why(batch(answer_of(object, 5, good) + "," + answer_of(object, 5, good))) ==
               "sends an object that it was not asked for");
    BOOST_TEST(why(batch(answer_of(object, 6, good))) == "has another size for an object");
    BOOST_TEST(why(batch(answer_of(object, 5, download("")))) == "sends an address that is none");
    BOOST_TEST(why(batch(answer_of(object, 5, download("https://a/\\n")))) ==
               "sends an address that is none");
    BOOST_TEST(why(batch(answer_of(object, 5, download(std::string(9000, 'x'))))) ==
               "sends an address that is none");
}

BOOST_AUTO_TEST_CASE(headers_are_few_and_short_and_are_lines)
{
    auto const with = [](std::string const& header) {
        return parse_lfs_batch(batch(answer_of(object, 5, download("https://a/b", header))), two_pointers());
    };
    for (auto const* const header : {R"({"A":"x\r\nHost: y"})", R"({"A b":"x"})", R"({"A:":"x"})",
                                     R"({"":"x"})", R"({"A\n":"x"})", R"({"A":1})", R"({"A":"\u0000"})"})
        BOOST_TEST(with(header).error().message() == "sends a header that is none", header);
    std::string many;
    for (int i = 0; i < 33; ++i)
        many += (i == 0 ? "{\"x-ms-A" : "\",\"x-ms-A") + std::to_string(i) + "\":\"x";
    BOOST_TEST(with(many + "\"}").error().message() == "asks for too many headers");
    BOOST_TEST(with("{\"Accept\":\"" + std::string(17'000, 'x') + "\"}").error().message() ==
               "asks for too many headers");
    auto const ours = with(R"({"Host":"x","CONTENT-length":"1","Metadata-Flavor":"Google","Accept":"a",)"
                           R"("X-Forwarded-For":"::1","Proxy-Authorization":"x","Cookie":"x","X-Any":"x"})");
    BOOST_TEST_REQUIRE(ours.has_value());
    BOOST_TEST((*ours)[0].headers == (std::vector<std::string>{"Accept: a"}),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(files_come_over_tls_from_public_hosts)
{
    for (auto const* const url :
         {"https://forge.org/x", "https://FORGE.org:8443/x", "https://cdn.example.com/x?y=z",
          "https://8.8.8.8/x", "https://[2a00:1450::1]/x"})
        BOOST_TEST(check_lfs_address(url, forge).has_value(), url);
    for (auto const* const url : {"http://forge.org/x", "http://cdn.example.com/x"})
        BOOST_TEST(check_lfs_address(url, forge).error().message() == "sends an address without TLS", url);
    for (auto const* const url :
         {"", "x", "file:///etc/passwd", "gopher://a.org/x", "https://user@cdn.example.com/x",
          "https://user:word@forge.org/x", "https:///x", "//cdn.example.com/x", "https://a b/x",
          "https://a.org\\@b/x", "https://%6cocalhost/x"})
        BOOST_TEST(check_lfs_address(url, forge).error().message() == "sends an address that is not HTTPS",
                   url);
    for (auto const* const url :
         {"https://localhost/x", "https://localhost./x", "https://127.0.0.1/x", "https://10.1.2.3/x",
          "https://169.254.169.254/latest", "https://192.168.1.1/x", "https://[::1]/x",
          "https://[::ffff:10.0.0.1]/x", "https://[fe80::1]/x", "https://[fd00::1]/x", "https://printer/x",
          "https://nas.local/x", "https://2130706433/x", "https://127.1/x", "https://0x7f.0.0.0x1/x",
          "https://metadata.google.internal/x"})
        BOOST_TEST(check_lfs_address(url, forge).error().message() == "sends an address of a private network",
                   url);
}

BOOST_AUTO_TEST_CASE(a_forge_of_a_private_network_may_name_hosts_of_it_and_itself_always)
{
    BOOST_TEST(check_lfs_address("http://10.0.0.7:9000/x", "http://git.lan").has_value());
    BOOST_TEST(check_lfs_address("https://minio.lan/x", "https://10.0.0.5").has_value());
    BOOST_TEST(check_lfs_address("http://minio.lan/x", "https://10.0.0.5").has_error());
    BOOST_TEST(check_lfs_address("http://git.lan/x", "http://git.lan:3000").has_value());
}

BOOST_AUTO_TEST_CASE(addresses_that_mean_something_else_everywhere_are_not_public)
{
    for (auto const* const text :
         {"0.0.0.0",          "10.0.0.1",        "100.64.0.1",      "127.0.0.1",   "127.255.255.254",
          "169.254.169.254",  "172.16.0.1",      "172.31.255.255",  "192.0.0.192", "192.168.0.1",
          "198.18.0.1",       "224.0.0.1",       "255.255.255.255", "::",          "::1",
          "::ffff:127.0.0.1", "64:ff9b::7f00:1", "fe80::1%eth0",    "fc00::1",     "ff02::1",
          "2002:7f00:1::",    "2001:db8::1",     "2001:0:1::1"})
        BOOST_TEST(!is_public_address(*IpAddress::parse(text)), text);
    for (auto const* const text : {"8.8.8.8", "100.63.255.255", "172.32.0.1", "192.0.1.1", "::ffff:8.8.8.8",
                                   "64:ff9b::808:808", "2606:4700::1", "2a00:1450:4001:830::200e"})
        BOOST_TEST(is_public_address(*IpAddress::parse(text)), text);
}

BOOST_AUTO_TEST_CASE(the_base_of_an_address_ends_where_its_path_begins)
{
    BOOST_TEST(base_of("https://a.org:1/b/c?d") == "https://a.org:1");
    BOOST_TEST(base_of("https://a.org?d=/e") == "https://a.org");
    BOOST_TEST(base_of("https://a.org") == "https://a.org");
}

BOOST_AUTO_TEST_SUITE_END()
