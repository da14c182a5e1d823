#include "unit_test.hpp"

#include "core/base64.hpp"
#include "core/classes/class_book.hpp"
#include "core/text.hpp"

#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>

#include <string>
#include <vector>

using namespace webots_cloud;
using namespace webots_cloud::core;
using namespace std::chrono_literals;

BOOST_TEST_DONT_PRINT_LOG_VALUE(SeatRequest)

// Protocol section 13.15.
BOOST_AUTO_TEST_SUITE(class_book)

namespace {

constexpr std::string_view world = "https://e.org/o/r/blob/main/worlds/a.wbt";

/// A book, and the browsers that are connected to it.
struct Fixture
{
    Fixture() : book(hooks()) { book.set_password("secret"); }

    ClassHooks hooks()
    {
        ClassHooks hooks;
        hooks.random = [this](std::size_t size) {
            std::string bytes(size, '\0');
            for (auto& byte : bytes)
                byte = static_cast<char>((seed = seed * 1'103'515'245 + 12'345) >> 16 & 0x7F);
            return bytes;
        };
        hooks.free_seats = [this] { return free_seats; };
        hooks.machines = [this](ClassConnection) { return machines; };
        hooks.simulator_address = [](std::string_view entry, ClassConnection teacher) {
            return concat("wss://", entry.starts_with('*') ? concat("seen-by-", std::to_string(teacher)) : "",
                          entry.substr(entry.starts_with('*') ? 1 : 0));
        };
        hooks.tell_of_guesses = [this](std::string_view what, std::string_view who) {
            guesses.push_back(concat(what, " ", who));
        };
        return hooks;
    }

    ClassConnection connect(std::string quota_key = "203.0.113.7")
    {
        book.connect(++last, std::move(quota_key));
        collect();
        return last;
    }

    /// What this browser is told in answer; what others are told is in `told`.
    std::vector<std::string> say(ClassConnection from, std::string_view text)
    {
        told[from].clear();
        book.take(from, text, now);
        collect();
        return told[from];
    }

    void leave(ClassConnection connection)
    {
        book.disconnect(connection, now);
        collect();
    }

    void pass(Duration time)
    {
        now += time;
        book.expire(now);
        collect();
    }

    void collect()
    {
        for (auto& output : book.take_output()) {
            if (!output.text.empty())
                told[output.to].push_back(std::move(output.text));
            if (output.close_code != 0)
                closed[output.to] = output.close_code;
            pictures += output.is_picture ? 1 : 0;
        }
    }

    ClassConnection open_class(std::size_t seats = 30, std::string quota_key = "203.0.113.7")
    {
        auto const teacher = connect(std::move(quota_key));
        auto const answer = say(teacher, concat(R"({"teach":{"password":"secret","world":")", world,
                                                R"(","mode":"mjpeg","seats":)", std::to_string(seats), "}}"));
        BOOST_REQUIRE(answer.size() == 1u);
        auto const message = boost::json::parse(answer[0]);
        BOOST_REQUIRE(message.get_object().contains("class"));
        row = message.at("class").get_object();
        code = text_of(row.at("code"));
        return teacher;
    }

    ClassConnection join(std::string_view name)
    {
        auto const student = connect();
        auto const answer = say(student, concat(R"({"join":{"code":")", code, R"(","name":")", name, "\"}}"));
        BOOST_REQUIRE(!answer.empty());
        auto const message = boost::json::parse(answer[0]);
        BOOST_REQUIRE_MESSAGE(message.get_object().contains("joined"), answer[0]);
        token = text_of(message.at("joined").at("token"));
        seat = text_of(message.at("joined").at("seat"));
        return student;
    }

    static std::string text_of(boost::json::value const& value)
    {
        return std::string(value.as_string().data(), value.as_string().size());
    }

    std::string last_told(ClassConnection connection)
    {
        return told[connection].empty() ? std::string() : told[connection].back();
    }

    /// The code of the only answer, an error.
    std::string error_of(std::vector<std::string> const& answer)
    {
        if (answer.size() != 1 || !boost::json::parse(answer[0]).get_object().contains("error"))
            return {};
        return text_of(boost::json::parse(answer[0]).at("error"));
    }

    unsigned seed = 1;
    std::size_t free_seats = 1000;
    std::vector<std::string> machines{"ws://h:2000"};
    std::vector<std::string> guesses;
    TimePoint now{1000s};
    ClassConnection last = 0;
    std::map<ClassConnection, std::vector<std::string>> told;
    std::map<ClassConnection, int> closed;
    int pictures = 0;
    boost::json::object row; ///< Of the class that was opened last.
    std::string code;
    std::string token; ///< Of the student who joined last.
    std::string seat;  ///< The same student's token for seats.
    ClassBook book;
};

std::string picture(std::size_t bytes = 100)
{
    std::string jpeg("\xff\xd8\xff\xc0\0\x0b\x08\0\x78\0\xa0\x01\x01\x11", 14); // 160x120 pixels
    jpeg.resize(bytes);
    return concat(R"({"picture":")", base64(jpeg), "\"}");
}

using Texts = std::vector<std::string>;

} // namespace

BOOST_AUTO_TEST_CASE(a_teacher_reads_a_program_once_for_each_question_and_gives_one_to_all)
{
    Fixture fixture;
    auto const teacher = fixture.open_class(30);
    auto const ada = fixture.join("Ada");
    auto const program = R"({"program":{"file":"a/a.py","text":"x"}})";
    auto const before = fixture.last_told(teacher);
    (void)fixture.say(ada, program); // nobody has asked
    BOOST_TEST(fixture.last_told(teacher) == before);
    (void)fixture.say(teacher, R"({"tell":{"students":[1],"do":"program"}})");
    BOOST_TEST(fixture.last_told(ada) == R"({"do":"program"})");
    (void)fixture.say(ada, program);
    BOOST_TEST(fixture.last_told(teacher) == R"({"program":{"id":1,"file":"a/a.py","text":"x"}})");
    (void)fixture.say(ada, R"({"program":{"file":"a/a.py","text":"once more"}})");
    BOOST_TEST(fixture.last_told(teacher) == R"({"program":{"id":1,"file":"a/a.py","text":"x"}})");
    auto const bob = fixture.join("Bob");
    (void)fixture.say(teacher, R"({"tell":{"students":null,"do":"take","file":"a/a.py","text":"start"}})");
    for (auto const student : {ada, bob})
        BOOST_TEST(fixture.last_told(student) == R"({"do":"take","file":"a/a.py","text":"start"})");
    auto const told = fixture.last_told(bob);
    (void)fixture.say(ada,
                      R"({"tell":{"students":null,"do":"take","file":"a/a.py","text":"mine"}})"); // a student
    BOOST_TEST(fixture.last_told(bob) == told);
}

BOOST_AUTO_TEST_CASE(a_code_is_checked_before_a_name_is_asked_for)
{
    Fixture fixture;
    (void)fixture.open_class(1);
    auto const student = fixture.connect();
    auto const check = [&](std::string_view code) {
        return fixture.say(student, concat(R"({"check":")", code, "\"}"));
    };
    BOOST_TEST(check(fixture.code) == Texts{concat(R"({"checked":")", fixture.code, "\"}")},
               boost::test_tools::per_element());
    BOOST_TEST(fixture.book.figures().students == 0u);
    BOOST_TEST(fixture.error_of(check("222222")) == "code");
    BOOST_TEST(fixture.error_of(check("nonsense")) == "code");
    (void)fixture.join("Ada");
    (void)fixture.join("Bob");
    BOOST_TEST(fixture.error_of(check(fixture.code)) == "full");
}

BOOST_AUTO_TEST_CASE(who_checks_many_codes_guesses)
{
    Fixture fixture;
    (void)fixture.open_class();
    std::string error = "code";
    for (int tries = 0; tries < 600 && error == "code"; ++tries) {
        if (tries % 50 == 0)
            (void)fixture.connect();
        error = fixture.error_of(fixture.say(fixture.last, R"({"check":"222222"})"));
    }
    BOOST_TEST(error == "tries");
    BOOST_TEST(fixture.guesses.size() == 1u);
}

BOOST_AUTO_TEST_CASE(a_student_raises_a_hand_or_is_done_until_the_teacher_has_seen_it)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    auto const ada = fixture.join("Ada");
    BOOST_TEST(fixture.say(ada, R"({"sign":"hand"})") == Texts{R"({"sign":"hand"})"},
               boost::test_tools::per_element());
    auto const raised = R"({"student":{"id":1,"name":"Ada","state":"joined","time":0,"sign":"hand"}})";
    BOOST_TEST(fixture.last_told(teacher) == raised);
    // Whoever comes back has it still.
    auto const back = fixture.connect();
    auto const joined = fixture.say(back, concat(R"({"join":{"token":")", fixture.token, "\"}}"));
    BOOST_REQUIRE(!joined.empty());
    BOOST_TEST(fixture.text_of(boost::json::parse(joined[0]).at("joined").at("sign")) == "hand");
    (void)fixture.say(teacher, R"({"tell":{"students":[1],"do":"lower"}})");
    BOOST_TEST(fixture.last_told(back) == R"({"sign":"none"})");
    BOOST_TEST(fixture.last_told(teacher) ==
               R"({"student":{"id":1,"name":"Ada","state":"joined","time":0}})");
    fixture.told[back].clear();
    (void)fixture.say(teacher, R"({"tell":{"students":[1],"do":"lower"}})"); // there is nothing to lower
    BOOST_TEST(fixture.told[back].empty());
    BOOST_TEST(fixture.error_of(fixture.say(teacher, R"({"sign":"hand"})")) == "message");
}

BOOST_AUTO_TEST_CASE(a_hand_that_waves_does_not_flood_the_teacher)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    auto const ada = fixture.join("Ada");
    fixture.told[teacher].clear();
    for (int i = 0; i < 20; ++i)
        (void)fixture.say(ada, i % 2 == 0 ? R"({"sign":"hand"})" : R"({"sign":"none"})");
    BOOST_TEST(fixture.told[teacher].size() == 5u);
    BOOST_TEST(fixture.last_told(ada) == R"({"sign":"hand"})"); // as the teacher sees it
    fixture.pass(1s);
    BOOST_TEST(fixture.say(ada, R"({"sign":"done"})") == Texts{R"({"sign":"done"})"},
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(the_teacher_is_told_why_a_student_waits)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    auto const ada = fixture.join("Ada");
    (void)fixture.say(ada, R"({"state":{"state":"waiting","why":"busy","ahead":3}})");
    BOOST_TEST(fixture.last_told(teacher) ==
               R"({"student":{"id":1,"name":"Ada","state":"waiting","time":0,"why":"busy","ahead":3}})");
    fixture.leave(ada);
    BOOST_TEST(fixture.last_told(teacher) == R"({"student":{"id":1,"name":"Ada","state":"away","time":0}})");
}

BOOST_AUTO_TEST_CASE(the_teacher_is_told_which_program_a_student_runs)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    auto const ada = fixture.join("Ada");
    (void)fixture.say(ada,
                      R"({"state":{"state":"running","program":{"file":"a/a.py","changed":true,"line":3}}})");
    BOOST_TEST(fixture.last_told(teacher) == R"({"student":{"id":1,"name":"Ada","state":"running","time":0,)"
                                             R"("program":{"file":"a/a.py","changed":true,"line":3}}})");
    fixture.leave(ada); // nobody knows any more
    BOOST_TEST(fixture.last_told(teacher) == R"({"student":{"id":1,"name":"Ada","state":"away","time":0}})");
}

BOOST_AUTO_TEST_CASE(whom_the_teacher_tells_to_start_again_gets_a_seat_of_the_class)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    auto const ada = fixture.join("Ada");
    auto const start = [&] {
        auto const seat = fixture.book.ask_for_seat(fixture.seat, fixture.now);
        fixture.book.take_seat(fixture.seat, seat, StudentMachine{}, fixture.now);
        return seat;
    };
    std::vector<SeatRequest> often;
    for (int i = 0; i < 4; ++i)
        often.push_back(start());
    BOOST_TEST((often.back() == SeatRequest::any)); // by herself, she may have so many
    (void)fixture.say(teacher, R"({"tell":{"students":null,"do":"start"}})");
    BOOST_TEST(fixture.last_told(ada) == R"({"do":"start"})");
    BOOST_TEST((start() == SeatRequest::held));
}

BOOST_AUTO_TEST_CASE(another_world_is_for_all_and_everybody_begins_anew)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    auto const ada = fixture.join("Ada");
    auto const seat = fixture.seat;
    auto const bob = fixture.join("Bob");
    (void)fixture.say(ada, R"({"sign":"done"})");
    for (int i = 0; i < 4; ++i)
        fixture.book.take_seat(seat, fixture.book.ask_for_seat(seat, fixture.now), StudentMachine{},
                               fixture.now);
    auto const changed = R"({"world":{"world":"https://e.org/b.wbt","mode":"w3d"}})";
    auto const told = fixture.say(teacher, changed);
    BOOST_TEST(told == (Texts{changed, R"({"student":{"id":1,"name":"Ada","state":"joined","time":0}})"}),
               boost::test_tools::per_element());
    BOOST_TEST(fixture.last_told(ada) == changed);
    BOOST_TEST(fixture.told[ada].at(fixture.told[ada].size() - 2) == R"({"sign":"none"})");
    BOOST_TEST(fixture.last_told(bob) == changed);
    BOOST_TEST((fixture.book.ask_for_seat(seat, fixture.now) == SeatRequest::held));
    auto const cyd = fixture.connect();
    auto const joined = fixture.say(cyd, concat(R"({"join":{"code":")", fixture.code, R"(","name":"Cyd"}})"));
    BOOST_TEST(fixture.text_of(boost::json::parse(joined.at(0)).at("joined").at("world")) ==
               "https://e.org/b.wbt");
    BOOST_TEST(fixture.error_of(fixture.say(ada, changed)) == "message");
}

BOOST_AUTO_TEST_CASE(a_class_from_its_opening_to_its_end)
{
    Fixture fixture;
    fixture.free_seats = 18;
    auto const teacher = fixture.open_class(30);
    BOOST_TEST(fixture.row.at("seats").as_int64() == 30);
    BOOST_TEST(fixture.row.at("reserved").as_int64() == 18);
    BOOST_TEST(boost::json::serialize(fixture.row.at("machines")) == R"(["ws://h:2000"])");
    auto const ada = fixture.join("Ada");
    BOOST_TEST(fixture.last_told(ada) == R"({"pictures":null})");
    BOOST_TEST(fixture.last_told(teacher) ==
               R"({"student":{"id":1,"name":"Ada","state":"joined","time":0}})");
    (void)fixture.say(ada, R"({"state":{"state":"running","time":32}})");
    BOOST_TEST(fixture.last_told(teacher) ==
               R"({"student":{"id":1,"name":"Ada","state":"running","time":32}})");
    (void)fixture.say(teacher, R"({"tell":{"students":[1],"do":"pause"}})");
    BOOST_TEST(fixture.last_told(ada) == R"({"do":"pause"})");
    (void)fixture.say(teacher, R"({"tell":{"students":null,"do":"message","text":"Hi"}})");
    BOOST_TEST(fixture.last_told(ada) == R"({"do":"message","text":"Hi"})");
    BOOST_TEST(fixture.book.figures().classes == 1u);
    BOOST_TEST(fixture.book.figures().students == 1u);
    BOOST_TEST(fixture.book.figures().seats_held == 30u);
    (void)fixture.say(teacher, R"({"close":true})");
    for (auto const each : {teacher, ada}) {
        BOOST_TEST(fixture.last_told(each) == R"({"closed":"teacher"})");
        BOOST_TEST(fixture.closed[each] == 1000);
    }
    BOOST_TEST(fixture.book.figures().classes == 0u);
    BOOST_TEST(fixture.book.figures().students == 0u);
    BOOST_TEST(fixture.book.seats_to_hold() == 0u);
    fixture.leave(ada);
    fixture.leave(teacher);
    auto const late = fixture.connect();
    BOOST_TEST(fixture.error_of(fixture.say(late, concat(R"({"join":{"token":")", fixture.token, "\"}}"))) ==
               "code");
}

BOOST_AUTO_TEST_CASE(only_the_password_opens_a_class)
{
    Fixture fixture;
    auto const teacher = fixture.connect();
    auto const open =
        concat(R"({"teach":{"password":"Secret","world":")", world, R"(","mode":"mjpeg","seats":3}})");
    BOOST_TEST(fixture.error_of(fixture.say(teacher, open)) == "password");
    BOOST_TEST(!fixture.closed.contains(teacher)); // and may try again
    fixture.book.set_password("");
    BOOST_TEST(fixture.error_of(fixture.say(teacher, open)) == "off");
    fixture.book.set_password("Secret");
    BOOST_TEST(fixture.say(teacher, open).size() == 1u);
    BOOST_TEST(fixture.book.figures().classes == 1u);
    BOOST_TEST(fixture.error_of(fixture.say(teacher, open)) == "message"); // one class for each connection
}

BOOST_AUTO_TEST_CASE(a_class_goes_on_when_the_password_changes)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    fixture.book.set_password("another");
    fixture.leave(teacher);
    auto const again = fixture.connect();
    auto const key = Fixture::text_of(fixture.row.at("key"));
    BOOST_TEST(fixture.say(again, concat(R"({"teach":{"key":")", key, "\"}}")).size() == 1u);
    BOOST_TEST(fixture.last_told(again).starts_with(R"({"class":{)"));
    BOOST_TEST(fixture.error_of(fixture.say(fixture.connect(), R"({"teach":{"key":"guessed"}})")) == "code");
}

BOOST_AUTO_TEST_CASE(who_guesses_passwords_is_slowed_down_and_reported)
{
    Fixture fixture;
    auto const open =
        concat(R"({"teach":{"password":"?","world":")", world, R"(","mode":"mjpeg","seats":3}})");
    int tried = 0;
    for (int i = 0; i < 100; ++i)
        tried += fixture.error_of(fixture.say(fixture.connect("a"), open)) == "password" ? 1 : 0;
    BOOST_TEST(tried == 10);
    BOOST_TEST(fixture.guesses.front() == "passwords of teachers a");
    // The right one is refused as well: or else it would be found as fast as ever.
    auto const right =
        concat(R"({"teach":{"password":"secret","world":")", world, R"(","mode":"mjpeg","seats":3}})");
    BOOST_TEST(fixture.error_of(fixture.say(fixture.connect("a"), right)) == "tries");
    BOOST_TEST(fixture.say(fixture.connect("b"), right).front().starts_with(R"({"class")"));
    fixture.now += 10s;
    BOOST_TEST(fixture.say(fixture.connect("a"), right).front().starts_with(R"({"class")"));
    // Many addresses gain one guess each, and shut nobody out.
    fixture.now += 100s;
    for (int round = 0; round < 2; ++round) {
        tried = 0;
        for (int i = 0; i < 200; ++i)
            tried +=
                fixture.error_of(fixture.say(fixture.connect(std::to_string(i)), open)) == "password" ? 1 : 0;
        BOOST_TEST(tried == (round == 0 ? 200 : 0));
    }
    BOOST_TEST(fixture.say(fixture.connect("c"), right).front().starts_with(R"({"class")"));
}

BOOST_AUTO_TEST_CASE(who_guesses_codes_is_slowed_down_and_who_returns_is_not)
{
    Fixture fixture;
    (void)fixture.open_class();
    auto const ada = fixture.join("Ada");
    auto const wrong = std::string(R"({"join":{"code":"222222","name":"Eve"}})");
    int tried = 0;
    for (int i = 0; i < 1000; ++i)
        tried += fixture.error_of(fixture.say(fixture.connect("a"), wrong)) == "code" ? 1 : 0;
    BOOST_TEST(tried == 500);
    BOOST_TEST(fixture.guesses.front() == "codes of classes a");
    auto const right = concat(R"({"join":{"code":")", fixture.code, R"(","name":"Eve"}})");
    BOOST_TEST(fixture.error_of(fixture.say(fixture.connect("a"), right)) == "tries");
    fixture.leave(ada);
    auto const back = fixture.connect("a");
    (void)fixture.say(back, concat(R"({"join":{"token":")", fixture.token, "\"}}"));
    BOOST_TEST(fixture.told[back].front().starts_with(R"({"joined":{"id":1,)"));
    fixture.now += 2s;
    BOOST_TEST(fixture.say(fixture.connect("a"), right).front().starts_with(R"({"joined")"));
    fixture.now += 1000s;
    for (int round = 0; round < 2; ++round) {
        tried = 0;
        for (int i = 0; i < 2000; ++i)
            tried +=
                fixture.error_of(fixture.say(fixture.connect(std::to_string(i)), wrong)) == "code" ? 1 : 0;
        BOOST_TEST(tried == (round == 0 ? 2000 : 0)); // many addresses gain one guess each
    }
    BOOST_TEST(fixture.say(fixture.connect("b"), right).front().starts_with(R"({"joined")"));
}

BOOST_AUTO_TEST_CASE(there_are_not_too_many_classes_students_or_windows)
{
    Fixture fixture;
    for (int i = 0; i < 20; ++i)
        (void)fixture.open_class(2);
    auto const open =
        concat(R"({"teach":{"password":"secret","world":")", world, R"(","mode":"mjpeg","seats":3}})");
    BOOST_TEST(fixture.error_of(fixture.say(fixture.connect(), open)) == "limit");
    for (int i = 0; i < 4; ++i)
        (void)fixture.join("Ada"); // two for each seat
    auto const join = concat(R"({"join":{"code":")", fixture.code, R"(","name":"Bob"}})");
    for (int i = 0; i < 1000; ++i)
        BOOST_TEST(fixture.error_of(fixture.say(fixture.connect(), join)) == "full");
    BOOST_TEST(fixture.book.figures().students == 4u);
    auto const key = concat(R"({"teach":{"key":")", Fixture::text_of(fixture.row.at("key")), "\"}}");
    for (int i = 0; i < 7; ++i)
        BOOST_TEST(fixture.say(fixture.connect(), key).front().starts_with(R"({"class")"));
    BOOST_TEST(fixture.error_of(fixture.say(fixture.connect(), key)) == "limit");
}

BOOST_AUTO_TEST_CASE(connections_that_say_nothing_are_closed_when_there_are_too_many)
{
    Fixture fixture;
    auto const teacher = fixture.open_class(100);
    auto const ada = fixture.join("Ada");
    auto const silent = fixture.connect();
    for (int i = 0; i < 300; ++i)
        (void)fixture.connect();
    BOOST_TEST(fixture.closed[silent] == 1013);
    BOOST_TEST(!fixture.closed.contains(teacher)); // those in a class stay
    BOOST_TEST(!fixture.closed.contains(ada));
    BOOST_TEST(fixture.say(silent, R"({"teach":{"key":""}})").empty());
}

BOOST_AUTO_TEST_CASE(pictures_are_relayed_only_while_a_teacher_watches)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    auto const ada = fixture.join("Ada");
    (void)fixture.say(ada, picture());
    BOOST_TEST(fixture.pictures == 0);
    (void)fixture.say(teacher, R"({"watch":true})");
    BOOST_TEST(fixture.last_told(ada) ==
               R"({"pictures":{"interval":500,"width":160,"height":120,"bytes":2800}})");
    fixture.now += 1s;
    (void)fixture.say(ada, picture());
    BOOST_TEST(fixture.pictures == 1);
    BOOST_TEST(fixture.last_told(teacher).starts_with(R"({"picture":{"id":1,"jpeg":"/9j/)"));
    auto const bob = fixture.join("Bob"); // who is told right away
    BOOST_TEST(fixture.last_told(bob).starts_with(R"({"pictures":{)"));
    (void)fixture.say(teacher, R"({"watch":false})");
    BOOST_TEST(fixture.last_told(ada) == R"({"pictures":null})");
    fixture.now += 1s;
    (void)fixture.say(ada, picture());
    BOOST_TEST(fixture.pictures == 1);
    (void)fixture.say(teacher, R"({"watch":true})");
    fixture.leave(teacher);
    BOOST_TEST(fixture.last_told(ada) == R"({"pictures":null})");
}

BOOST_AUTO_TEST_CASE(pictures_that_are_too_early_too_large_or_none_are_dropped)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    auto const ada = fixture.join("Ada");
    (void)fixture.say(teacher, R"({"watch":true})");
    for (int i = 0; i < 50; ++i)
        (void)fixture.say(ada, picture());
    BOOST_TEST(fixture.pictures == 2);
    fixture.now += 60s;
    (void)fixture.say(ada, picture(2803));
    (void)fixture.say(ada, R"({"picture":"<svg onload=alert(1)>"})");
    (void)fixture.say(ada, R"({"picture":"iVBORw0KGgo="})");
    (void)fixture.say(ada, R"({"picture":"/9j/wAALCD6AQoABAREAAAAA"})"); // of 17024x16000 pixels
    BOOST_TEST(fixture.pictures == 2);
    (void)fixture.say(ada, picture(2800));
    BOOST_TEST(fixture.pictures == 3);
    // In the long run as many as were asked for, however many come.
    for (int i = 0; i < 1000; ++i) {
        (void)fixture.say(ada, picture());
        fixture.now += 100ms;
    }
    BOOST_TEST(fixture.pictures >= 200);
    BOOST_TEST(fixture.pictures <= 206);
}

BOOST_AUTO_TEST_CASE(many_students_are_asked_for_fewer_pictures)
{
    Fixture fixture;
    auto const teacher = fixture.open_class(100);
    (void)fixture.say(teacher, R"({"watch":true})");
    auto const first = fixture.join("Ada");
    for (int i = 0; i < 29; ++i)
        (void)fixture.join("Bob");
    BOOST_TEST(fixture.told[first].size() == 2u); // joined and pictures: nothing has changed
    (void)fixture.join("Bob");
    BOOST_TEST(fixture.last_told(first).starts_with(R"({"pictures":{"interval":750,)"));
}

BOOST_AUTO_TEST_CASE(states_that_come_too_often_are_dropped)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    auto const ada = fixture.join("Ada");
    fixture.told.clear();
    for (int i = 0; i < 1000; ++i) {
        (void)fixture.say(ada, R"({"state":{"state":"running","time":1}})");
        fixture.now += 100ms;
    }
    BOOST_TEST(fixture.told[teacher].size() >= 200u);
    BOOST_TEST(fixture.told[teacher].size() <= 204u);
}

BOOST_AUTO_TEST_CASE(who_floods_is_cut_off)
{
    Fixture fixture;
    (void)fixture.open_class();
    auto const ada = fixture.join("Ada");
    for (int i = 0; i < 1000; ++i)
        (void)fixture.say(ada, picture());
    BOOST_TEST(fixture.closed[ada] == 1008);
    auto const stranger = fixture.connect();
    for (int i = 0; i < 1000; ++i)
        (void)fixture.say(stranger, "nonsense");
    BOOST_TEST(fixture.closed[stranger] == 1008);
    BOOST_TEST(fixture.told[stranger].size() <= 1u);
}

BOOST_AUTO_TEST_CASE(a_student_whose_connection_is_lost_returns_within_a_minute)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    auto const ada = fixture.join("Ada");
    (void)fixture.say(ada, R"({"state":{"state":"running","time":7}})");
    fixture.leave(ada);
    BOOST_TEST(fixture.last_told(teacher) == R"({"student":{"id":1,"name":"Ada","state":"away","time":7}})");
    fixture.pass(59s);
    auto const back = fixture.connect();
    (void)fixture.say(back, concat(R"({"join":{"token":")", fixture.token, "\"}}"));
    BOOST_TEST(fixture.last_told(teacher) ==
               R"({"student":{"id":1,"name":"Ada","state":"running","time":7}})");
    fixture.leave(back);
    fixture.pass(60s);
    BOOST_TEST(fixture.last_told(teacher) == R"({"gone":1})");
    auto const late = fixture.connect();
    BOOST_TEST(fixture.error_of(fixture.say(late, concat(R"({"join":{"token":")", fixture.token, "\"}}"))) ==
               "code");
}

BOOST_AUTO_TEST_CASE(a_second_window_of_a_student_takes_over)
{
    Fixture fixture;
    (void)fixture.open_class();
    auto const old = fixture.join("Ada");
    auto const next = fixture.connect();
    (void)fixture.say(next, concat(R"({"join":{"token":")", fixture.token, "\"}}"));
    BOOST_TEST(fixture.closed[old] == 4001);
    fixture.leave(old);
    (void)fixture.say(next, R"({"state":{"state":"running"}})");
    BOOST_TEST(fixture.book.figures().students == 1u);
    BOOST_TEST(!fixture.closed.contains(next));
}

BOOST_AUTO_TEST_CASE(a_student_who_leaves_or_is_removed_is_forgotten_at_once)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    auto const ada = fixture.join("Ada");
    auto const bob = fixture.join("Bob");
    (void)fixture.say(ada, R"({"leave":true})");
    BOOST_TEST(fixture.last_told(teacher) == R"({"gone":1})");
    BOOST_TEST(fixture.closed[ada] == 1000);
    fixture.leave(ada);
    (void)fixture.say(teacher, R"({"tell":{"students":[1,2,77],"do":"remove"}})");
    BOOST_TEST(fixture.last_told(bob) == R"({"closed":"removed"})");
    BOOST_TEST(fixture.closed[bob] == 1000);
    BOOST_TEST(fixture.last_told(teacher) == R"({"gone":2})");
    fixture.leave(bob);
    BOOST_TEST(fixture.book.figures().students == 0u);
}

BOOST_AUTO_TEST_CASE(a_class_whose_teacher_is_away_for_an_hour_ends)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    auto const ada = fixture.join("Ada");
    fixture.leave(teacher);
    fixture.pass(59min);
    BOOST_TEST(fixture.book.figures().classes == 1u);
    auto const back = fixture.connect();
    (void)fixture.say(back, concat(R"({"teach":{"key":")", Fixture::text_of(fixture.row.at("key")), "\"}}"));
    fixture.pass(2min);
    BOOST_TEST(fixture.book.figures().classes == 1u);
    fixture.leave(back);
    fixture.pass(60min);
    BOOST_TEST(fixture.book.figures().classes == 0u);
    BOOST_TEST(fixture.last_told(ada) == R"({"closed":"idle"})");
    BOOST_TEST(fixture.closed[ada] == 1000);
}

BOOST_AUTO_TEST_CASE(everybody_is_told_when_the_server_stops)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    auto const ada = fixture.join("Ada");
    fixture.book.stop();
    fixture.collect();
    BOOST_TEST(fixture.last_told(teacher) == R"({"closed":"server"})");
    BOOST_TEST(fixture.last_told(ada) == R"({"closed":"server"})");
}

BOOST_AUTO_TEST_CASE(teachers_and_students_cannot_say_what_the_others_say)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    auto const ada = fixture.join("Ada");
    auto const nobody = fixture.connect();
    for (auto const* text : {R"({"seats":5})", R"({"watch":true})", R"({"close":true})",
                             R"({"tell":{"students":null,"do":"end"}})", R"({"teach":{"key":""}})"})
        BOOST_TEST(fixture.error_of(fixture.say(ada, text)) == "message", text);
    for (auto const* text : {R"({"state":{"state":"running"}})", R"({"picture":"/9j/"})", R"({"leave":true})",
                             R"({"join":{"token":""}})"})
        BOOST_TEST(fixture.error_of(fixture.say(teacher, text)) == "message", text);
    for (auto const* text : {R"({"seats":5})", R"({"state":{"state":"running"}})", R"({"picture":"/9j/"})"})
        BOOST_TEST(fixture.error_of(fixture.say(nobody, text)) == "message", text);
    BOOST_TEST(fixture.book.figures().classes == 1u);
}

BOOST_AUTO_TEST_CASE(seats_are_held_until_students_take_them)
{
    Fixture fixture;
    auto const teacher = fixture.open_class(2);
    (void)fixture.join("Ada");
    auto const ada = fixture.seat;
    (void)fixture.join("Bob");
    auto const bob = fixture.seat;
    auto const student = fixture.join("Cyd");
    auto const cyd = fixture.seat;
    BOOST_TEST((fixture.book.ask_for_seat("guessed", fixture.now) == SeatRequest::unknown));
    BOOST_TEST((fixture.book.ask_for_seat(fixture.token, fixture.now) == SeatRequest::unknown));
    // Addresses stand in logs of proxies: what is in them is good for seats alone.
    BOOST_TEST(fixture.error_of(
                   fixture.say(fixture.connect(), concat(R"({"join":{"token":")", cyd, "\"}}"))) == "code");
    auto const take = [&fixture](std::string const& token) {
        auto const seat = fixture.book.ask_for_seat(token, fixture.now);
        fixture.book.take_seat(token, seat, {"h:2000", "ws://h:2000"}, fixture.now);
        return seat;
    };
    BOOST_TEST((take(ada) == SeatRequest::held));
    BOOST_TEST(fixture.book.seats_to_hold() == 1u);
    BOOST_TEST((take(ada) == SeatRequest::held)); // once more: its page has lost the first one
    BOOST_TEST(fixture.book.seats_to_hold() == 1u);
    BOOST_TEST((take(bob) == SeatRequest::held));
    BOOST_TEST(fixture.book.seats_to_hold() == 0u);
    BOOST_TEST((take(cyd) == SeatRequest::any));
    (void)fixture.say(teacher, R"({"seats":3})");
    BOOST_TEST((take(cyd) == SeatRequest::held));
    (void)fixture.say(student, R"({"state":{"state":"ended"}})");
    BOOST_TEST(fixture.book.seats_to_hold() == 1u);
    (void)fixture.say(teacher, R"({"tell":{"students":null,"do":"remove"}})");
    BOOST_TEST(fixture.book.seats_to_hold() == 3u);
    // Fewer seats than students have is none to hold, not very many.
    (void)fixture.join("Ada");
    BOOST_TEST((take(fixture.seat) == SeatRequest::held));
    (void)fixture.join("Bob");
    BOOST_TEST((take(fixture.seat) == SeatRequest::held));
    (void)fixture.say(teacher, R"({"seats":1})");
    BOOST_TEST(fixture.book.seats_to_hold() == 0u);
}

BOOST_AUTO_TEST_CASE(a_student_cannot_start_one_simulation_after_the_other)
{
    Fixture fixture;
    (void)fixture.open_class();
    (void)fixture.join("Ada");
    int starts = 0;
    for (int i = 0; i < 1000; ++i) {
        auto const seat = fixture.book.ask_for_seat(fixture.seat, fixture.now);
        if (seat == SeatRequest::too_often)
            continue;
        fixture.book.take_seat(fixture.seat, seat, {"h:2000", "ws://h:2000"}, fixture.now);
        ++starts;
    }
    BOOST_TEST(starts == 6);
    fixture.now += 10s;
    // Who finds no free machine may ask again as often as it likes.
    for (int i = 0; i < 1000; ++i)
        BOOST_TEST((fixture.book.ask_for_seat(fixture.seat, fixture.now) == SeatRequest::any));
}

// What they say of their simulations need not be true.
BOOST_AUTO_TEST_CASE(a_student_does_not_take_the_seats_of_the_others)
{
    Fixture fixture;
    (void)fixture.open_class();
    auto const eve = fixture.join("Eve");
    int held = 0;
    for (int i = 0; i < 59; ++i) {
        auto const seat = fixture.book.ask_for_seat(fixture.seat, fixture.now);
        BOOST_TEST((seat == (i < 2 ? SeatRequest::held : SeatRequest::any)));
        fixture.book.take_seat(fixture.seat, seat, {"h:2000", "ws://h:2000"}, fixture.now);
        held += seat == SeatRequest::held ? 1 : 0;
        (void)fixture.say(eve, R"({"state":{"state":"ended"}})");
        fixture.now += 10s;
    }
    BOOST_TEST(held == 2);
    fixture.now += 10s;
    BOOST_TEST((fixture.book.ask_for_seat(fixture.seat, fixture.now) == SeatRequest::held));
}

BOOST_AUTO_TEST_CASE(a_new_code_keeps_out_who_has_the_old_one)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    auto const ada = fixture.join("Ada");
    auto const token = fixture.token;
    auto const old = fixture.code;
    auto const answer = fixture.say(teacher, R"({"code":"new"})");
    BOOST_REQUIRE(answer.size() == 1u);
    fixture.code = Fixture::text_of(boost::json::parse(answer[0]).at("code"));
    BOOST_TEST(fixture.code != old);
    auto const late = fixture.connect();
    BOOST_TEST(fixture.error_of(
                   fixture.say(late, concat(R"({"join":{"code":")", old, R"(","name":"Eve"}})"))) == "code");
    (void)fixture.join("Bob");
    (void)fixture.say(ada, R"({"state":{"state":"running"}})");
    BOOST_TEST(fixture.last_told(teacher).find(R"("id":1,"name":"Ada","state":"running")") !=
               std::string::npos);
    auto const back = fixture.connect();
    (void)fixture.say(back, concat(R"({"join":{"token":")", token, "\"}}"));
    BOOST_TEST(fixture.told[back].front().starts_with(R"({"joined":{"id":1,)"));
    BOOST_TEST(fixture.error_of(fixture.say(back, R"({"code":"new"})")) == "message");
}

BOOST_AUTO_TEST_CASE(one_address_does_not_fill_a_class_again_and_again)
{
    Fixture fixture;
    auto const teacher = fixture.open_class(100);
    auto const join = concat(R"({"join":{"code":")", fixture.code, R"(","name":"Eve"}})");
    int joined = 0;
    for (int i = 0; i < 500; ++i) {
        joined += fixture.error_of(fixture.say(fixture.connect("a"), join)) != "tries" ? 1 : 0;
        if (i % 50 == 0)
            (void)fixture.say(teacher, R"({"tell":{"students":null,"do":"remove"}})");
    }
    BOOST_TEST(joined == 100);
    BOOST_TEST(fixture.say(fixture.connect("b"), join).front().starts_with(R"({"joined")"));
    fixture.now += 1s;
    BOOST_TEST(fixture.say(fixture.connect("a"), join).front().starts_with(R"({"joined")"));
}

BOOST_AUTO_TEST_CASE(free_seats_go_to_the_class_that_was_opened_first)
{
    Fixture fixture;
    fixture.free_seats = 10;
    auto const first = fixture.open_class(8);
    BOOST_TEST(fixture.row.at("reserved").as_int64() == 8);
    auto const second = fixture.open_class(8);
    BOOST_TEST(fixture.row.at("reserved").as_int64() == 2);
    fixture.free_seats = 12;
    fixture.pass(1s);
    BOOST_TEST(fixture.last_told(second) == R"({"reserved":4})");
    BOOST_TEST(fixture.told[first].size() == 1u);
    (void)fixture.say(first, R"({"seats":4})");
    BOOST_TEST(fixture.last_told(first) == R"({"reserved":4})");
    BOOST_TEST(fixture.last_told(second) == R"({"reserved":8})");
    fixture.free_seats = 0;
    fixture.pass(1s);
    BOOST_TEST(fixture.last_told(first) == R"({"reserved":0})");
}

BOOST_AUTO_TEST_CASE(a_student_cannot_send_the_teachers_page_to_another_host)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    auto const ada = fixture.join("Ada");
    auto const shown = [&](std::string_view simulator) {
        fixture.now += 1s;
        (void)fixture.say(ada, concat(R"({"state":{"state":"running","simulator":")", simulator, "\"}}"));
        return fixture.last_told(teacher).find("\"simulator\"") != std::string::npos;
    };
    BOOST_TEST(!shown("wss://h:2001")); // nothing was given yet
    fixture.book.take_seat(fixture.seat, SeatRequest::held, {"h/2000", "wss://h/2000"}, fixture.now);
    BOOST_TEST(shown("wss://h/2000/simulation/abc/2001"));
    BOOST_TEST(fixture.last_told(teacher).find(R"("simulator":"wss://h/2000/simulation/abc/2001")") !=
               std::string::npos);
    BOOST_TEST(shown("wss://H/2001"));
    for (auto const* simulator :
         {"ws://h/2001", "wss://evil.example/2000", "wss://h.evil.example/", "wss://h@evil.example/",
          "wss://evil.example\\\\@h/", "javascript:alert(1)", "https://h/", "", "wss://",
          "wss://h/2001/<script>", "wss://h/session?url=https://e.org/a.wbt", "wss://h/p/worlds/a.wbt"})
        BOOST_TEST(!shown(simulator), simulator);
    BOOST_TEST(!shown("wss://h/2000/simulation/" + std::string(300, 'a') + "/2001"));
}

// With the name `*` a student's browser says by `Host` how it calls the machine.
BOOST_AUTO_TEST_CASE(each_window_of_a_teacher_gets_a_simulator_as_it_reaches_the_machine)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    auto const key = Fixture::text_of(fixture.row.at("key"));
    auto const ada = fixture.join("Ada");
    fixture.book.take_seat(fixture.seat, SeatRequest::held, {"*:2000", "wss://evil.example:2000"},
                           fixture.now);
    (void)fixture.say(ada, R"({"state":{"state":"running","simulator":"wss://evil.example:2001"}})");
    auto const simulator_for = [](ClassConnection window) {
        return concat(R"("simulator":"wss://seen-by-)", std::to_string(window), ":2001\"");
    };
    BOOST_TEST(fixture.last_told(teacher).find(simulator_for(teacher)) != std::string::npos,
               fixture.last_told(teacher));
    auto const other = fixture.connect();
    (void)fixture.say(other, concat(R"({"teach":{"key":")", key, "\"}}"));
    BOOST_TEST(fixture.last_told(other).find(simulator_for(other)) != std::string::npos,
               fixture.last_told(other));
}

BOOST_AUTO_TEST_CASE(a_teachers_page_is_told_of_64_machines_at_most)
{
    Fixture fixture;
    fixture.machines.assign(1000, "ws://h:2000");
    (void)fixture.open_class();
    BOOST_TEST(fixture.row.at("machines").as_array().size() == 64u);
}

BOOST_AUTO_TEST_CASE(teachers_are_told_how_many_of_the_seats_nobody_has_taken_are_ready)
{
    Fixture fixture;
    fixture.free_seats = 30;
    auto const teacher = fixture.open_class(3);
    BOOST_TEST(!fixture.row.contains("staged"));
    auto const wishes = fixture.book.staging_wishes();
    BOOST_TEST_REQUIRE(wishes.size() == 1u);
    BOOST_TEST(wishes[0].url == world);
    BOOST_TEST(wishes[0].mode == "mjpeg");
    BOOST_TEST(wishes[0].count == 3);
    auto const note = [&fixture, teacher](std::vector<int> const& ready) {
        fixture.told[teacher].clear();
        fixture.book.note_ready(ready);
        fixture.collect();
        return fixture.told[teacher];
    };
    using Texts = std::vector<std::string>;
    BOOST_TEST(note({}) == Texts(), boost::test_tools::per_element()); // no machine stages any
    BOOST_TEST(note({2}) == Texts{R"({"staged":{"ready":2,"seats":3}})"}, boost::test_tools::per_element());
    BOOST_TEST(note({2}) == Texts(), boost::test_tools::per_element());
    auto const other = fixture.connect();
    auto const entered = fixture.say(
        other, concat(R"({"teach":{"key":)", boost::json::serialize(fixture.row.at("key")), "}}"));
    BOOST_TEST(entered.at(0).find(R"("staged":{"ready":2,"seats":3})") != std::string::npos, entered.at(0));

    (void)fixture.join("Ada");
    auto const asked = fixture.book.ask_for_seat(fixture.seat, fixture.now);
    fixture.book.take_seat(fixture.seat, asked, StudentMachine(), fixture.now);
    BOOST_TEST(fixture.book.staging_wishes()[0].count == 2);
    BOOST_TEST(note({2}) == Texts{R"({"staged":{"ready":2,"seats":2}})"}, boost::test_tools::per_element());
    BOOST_TEST(note({}) == Texts{R"({"staged":null})"}, boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(a_book_without_connections_holds_nothing)
{
    Fixture fixture;
    auto const teacher = fixture.open_class();
    auto const ada = fixture.join("Ada");
    fixture.leave(ada);
    fixture.leave(teacher);
    fixture.pass(60min);
    auto const figures = fixture.book.figures();
    BOOST_TEST(figures.classes + figures.students + figures.seats_held == 0u);
}

BOOST_AUTO_TEST_SUITE_END()
