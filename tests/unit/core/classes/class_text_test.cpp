#include "unit_test.hpp"

#include "core/classes/class_text.hpp"

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(class_text)

namespace {

/// Bytes in order, beginning with one.
RandomBytes counting_from(unsigned first)
{
    return [next = first](std::size_t size) mutable {
        std::string bytes;
        while (bytes.size() < size)
            bytes += static_cast<char>(next++ & 0xFF);
        return bytes;
    };
}

} // namespace

BOOST_AUTO_TEST_CASE(a_code_has_six_letters_or_digits_that_do_not_look_alike)
{
    for (unsigned first = 0; first < 256; ++first) {
        auto const code = make_class_code(counting_from(first));
        BOOST_TEST(code.size() == 6u);
        BOOST_TEST(code.find_first_of("01ILOU") == std::string::npos, code);
        BOOST_TEST(read_class_code(code) == code);
    }
    // 240 is the end of whole alphabets: those bytes are left out, so that each letter is as frequent.
    BOOST_TEST(make_class_code(counting_from(0)) == "234567");
    BOOST_TEST(make_class_code(counting_from(238)) == "YZ2345");
}

BOOST_AUTO_TEST_CASE(codes_are_read_as_people_type_them)
{
    BOOST_TEST(read_class_code(" k7m-2qx ") == "K7M2QX");
    BOOST_TEST(read_class_code("K7M2Q") == "");
    BOOST_TEST(read_class_code("K7M2QXX") == "");
    BOOST_TEST(read_class_code("K7M2QO") == "");
    BOOST_TEST(read_class_code(std::string(40, ' ') + "K7M2QX") == "");
    BOOST_TEST(read_class_code("") == "");
}

BOOST_AUTO_TEST_CASE(a_token_has_128_bits)
{
    BOOST_TEST(make_class_token(counting_from(0)) == "000102030405060708090a0b0c0d0e0f");
}

BOOST_AUTO_TEST_CASE(a_name_has_1_to_40_characters_of_any_script)
{
    BOOST_TEST((line_of_person("  Ada ", 40) == "Ada"));
    BOOST_TEST((line_of_person("<img src=x onerror=alert(1)>", 40) == "<img src=x onerror=alert(1)>"));
    BOOST_TEST((line_of_person("李 明", 40) == "李 明"));
    BOOST_TEST((line_of_person(std::string(40, 'a'), 40) == std::string(40, 'a')));
    std::string forty;
    for (int i = 0; i < 40; ++i)
        forty += "\U0001F916";
    BOOST_TEST((line_of_person(forty, 40) == forty));
    BOOST_TEST(!line_of_person(forty + "a", 40));
    BOOST_TEST(!line_of_person(std::string(41, 'a'), 40));
}

BOOST_AUTO_TEST_CASE(a_name_is_not_empty_invisible_or_misleading)
{
    for (auto const* name :
         {"", "   ", "a\nb", "a\tb", "\x1b[31m", "\xc2\x85", "Ada\xe2\x80\xae", "\xe2\x80\x8b",
          "A\xe2\x80\xa8"
          "B",
          "\xef\xbb\xbf", "\xe2\x81\xa6x", "\xe3\x85\xa4", "\xc3\x28", "\xf3\xa0\x81\x81", "x\xc2\xad",
          // a pattern of Braille without dots; spaces alone, of several kinds; joiners that join nothing
          "\u2800", "Ada\u2800", "\u3000", "\u00a0\u2003", "\u202f", "\u200d", "Ada\u200d", "A\u200cda",
          "A\ufe0f",
          // what has no character to be on, and what is no character yet
          "\u0301", " \u0301", "A \u0301", "\u034f", "a\u034f", "\u17b4", "\ue000", "\u0378", "\U0001343f",
          "Z\u0301\u0302\u0303\u0304\u0305"})
        BOOST_TEST(!line_of_person(name, 40), name);
    std::string heap = "Z";
    for (int i = 0; i < 38; ++i)
        heap += "\u0301";
    BOOST_TEST(!line_of_person(heap, 40));
}

BOOST_AUTO_TEST_CASE(names_of_all_scripts_are_names)
{
    for (auto const* name :
         {"Nguy\u1ec5n Th\u1ecb Minh Khai", "Nguye\u0302\u0303n", "\u0e1b\u0e34\u0e48\u0e19", // marks of Thai
          "\u0645\u06cc\u200c\u0631\u0648\u062f", "\u0915\u094d\u200d\u0937", // joiners of Persian and Hindi
          "\U0001f469\u200d\U0001f680", "\u2764\ufe0f\u200d\U0001f525",
          "1\ufe0f\u20e3", // emoji of several parts
          "\U0001fae8", "\U0001f1e8\U0001f1ed", "\u1e9e", "O\u2019Neil",
          "X \u00c6 A-12"}) // one of Unicode 15; a flag
        BOOST_TEST(line_of_person(name, 40).value_or("") == name, name);
    BOOST_TEST(line_of_person("\u674e\u3000\u660e\u00a0", 40).value_or("") ==
               "\u674e \u660e"); // the space of Japanese keyboards
}

BOOST_AUTO_TEST_CASE(a_world_has_an_address)
{
    for (auto const* world : {"https://github.com/o/r/blob/main/worlds/a.wbt",
                              "local:/demo_projects/robots/blob/main/worlds/a.wbt",
                              "https://e.org/o/r/blob/main/worlds/a.wbt?x=1"})
        BOOST_TEST(is_world_address(world), world);
    for (auto const* world :
         {"", "a.wbt", ":a.wbt", "https://e.org/a.x3d", "javascript:x.wbt", "https://e.org/ a.wbt",
          "https://e.org/\"a.wbt", "https://e.org/\n.wbt", "ht tp://e.org/a.wbt"})
        BOOST_TEST(!is_world_address(world), world);
    BOOST_TEST(!is_world_address("https://" + std::string(2048, 'a') + ".wbt"));
}

BOOST_AUTO_TEST_SUITE_END()
