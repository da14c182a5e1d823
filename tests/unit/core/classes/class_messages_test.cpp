#include "unit_test.hpp"

#include "core/classes/class_limits.hpp"
#include "core/classes/class_messages.hpp"
#include "core/simulation/editable_files.hpp"
#include "core/text.hpp"

#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>

#include <string>

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(class_messages)

namespace {

/// The error with which a message is refused; `off`: it is not.
ClassError refusal_of(std::string_view text)
{
    auto const message = parse_class_message(text);
    auto const* bad = std::get_if<BadClassMessage>(&message);
    return bad ? bad->error : ClassError::off;
}

template<class Message>
Message read(std::string_view text)
{
    auto const message = parse_class_message(text);
    BOOST_REQUIRE(std::holds_alternative<Message>(message));
    return std::get<Message>(message);
}

/// A message is one object with one key.
bool is_object_of(std::string_view text, std::string_view key)
{
    auto const value = boost::json::parse({text.data(), text.size()});
    return value.is_object() && value.get_object().contains(key);
}

} // namespace

BOOST_AUTO_TEST_CASE(a_teacher_opens_a_class_and_returns)
{
    auto const open = read<OpenClass>(
        R"({"teach":{"password":"p","world":"https://e.org/worlds/a.wbt","mode":"w3d","seats":30}})");
    BOOST_TEST(open.password == "p");
    BOOST_TEST(open.world == "https://e.org/worlds/a.wbt");
    BOOST_TEST(open.mode == "w3d");
    BOOST_TEST(open.seats == 30u);
    BOOST_TEST(read<ReturnAsTeacher>(R"({"teach":{"key":"k"}})").key == "k");
}

BOOST_AUTO_TEST_CASE(what_is_wrong_with_an_opening_is_said)
{
    auto const open = [](std::string const& rest) {
        return refusal_of(concat(R"({"teach":{"password":"p",)", rest, "}}"));
    };
    BOOST_TEST((open(R"("world":"x","mode":"w3d","seats":30)") == ClassError::world));
    BOOST_TEST((open(R"("world":"https://e.org/a.wbt","mode":"vr","seats":30)") == ClassError::world));
    for (auto const* seats : {"0", "101", "-1", "1.5", "\"3\"", "null", "1e9", "99999999999999999999"})
        BOOST_TEST((open(concat(R"("world":"https://e.org/a.wbt","mode":"x3d","seats":)", seats)) ==
                    ClassError::seats),
                   seats);
    BOOST_TEST((open(R"("world":"https://e.org/a.wbt")") == ClassError::message));
}

BOOST_AUTO_TEST_CASE(a_student_joins_and_returns)
{
    auto const join = read<JoinClass>(R"({"join":{"code":"k7m 2qx","name":" Ada "}})");
    BOOST_TEST(join.code == "K7M2QX");
    BOOST_TEST(join.name == "Ada");
    BOOST_TEST(read<JoinClass>(R"({"join":{"code":"nonsense","name":"Ada"}})").code == "");
    BOOST_TEST((refusal_of(R"({"join":{"code":"K7M2QX","name":" "}})") == ClassError::name));
    (void)read<RenewCode>(R"({"code":"new"})");
    BOOST_TEST((refusal_of(R"({"code":"K7M2QX"})") == ClassError::message)); // chance makes them
    BOOST_TEST(read<ReturnAsStudent>(R"({"join":{"token":"t"}})").token == "t");
}

BOOST_AUTO_TEST_CASE(states_are_those_that_students_may_have)
{
    auto const report =
        read<ReportState>(R"({"state":{"state":"running","time":1234.5,"simulator":"ws://h:2001"}})");
    BOOST_TEST((report.state == StudentState::running));
    BOOST_TEST(report.time == 1234);
    BOOST_TEST(report.simulator == "ws://h:2001");
    BOOST_TEST(read<ReportState>(R"({"state":{"state":"ended"}})").time == 0);
    for (auto const* state : {R"({"state":"away"})", R"({"state":"dancing"})", R"({"time":1})",
                              R"({"state":"running","time":-1})", R"({"state":"running","time":1e300})",
                              R"({"state":"running","time":"1"})"})
        BOOST_TEST((refusal_of(concat(R"({"state":)", state, "}")) == ClassError::message), state);
}

BOOST_AUTO_TEST_CASE(a_student_says_why_it_waits_in_a_word_or_a_line)
{
    auto const waiting = read<ReportState>(R"({"state":{"state":"waiting","why":" busy ","ahead":3}})");
    BOOST_TEST(waiting.why == "busy");
    BOOST_TEST((waiting.ahead == 3));
    for (auto const* rest : {R"("why":5,"ahead":"3")", R"("why":"\u0007","ahead":-1)", R"("ahead":100001)",
                             R"("ahead":1.5)", R"("why":" ")"}) {
        auto const report = read<ReportState>(concat(R"({"state":{"state":"waiting",)", rest, "}}"));
        BOOST_TEST(report.why == "", rest);
        BOOST_TEST(!report.ahead, rest);
    }
    auto const of = [](std::size_t length) {
        return concat(R"({"state":{"state":"ended","why":")", std::string(length, 'x'), R"("}})");
    };
    BOOST_TEST(read<ReportState>(of(200)).why.size() == 200u);
    BOOST_TEST(read<ReportState>(of(201)).why == "");
}

BOOST_AUTO_TEST_CASE(a_student_says_which_program_runs)
{
    auto const program = [](std::string_view text) {
        return read<ReportState>(concat(R"({"state":{"state":"running","program":)", text, "}}")).program;
    };
    auto const wrong = program(R"({"file":"drive/drive.py","changed":true,"line":12})").value();
    BOOST_TEST(wrong.file == "drive/drive.py");
    BOOST_TEST(wrong.is_changed);
    BOOST_TEST(wrong.wrong_line == 12);
    BOOST_TEST(!wrong.goal);
    auto const done = program(R"({"file":"drive/drive.py","changed":1,"line":-1,"goal":23400.5})").value();
    BOOST_TEST(!done.is_changed);
    BOOST_TEST(done.wrong_line == 0);
    BOOST_TEST((done.goal == 23400));
    BOOST_TEST(!program(R"({"file":"drive/drive.py","goal":"now"})").value().goal);
    for (auto const* text :
         {R"("drive/drive.py")", R"({"file":"../drive.py"})", R"({"file":7})", "{}", "null"})
        BOOST_TEST(!program(text), text);
}

BOOST_AUTO_TEST_CASE(a_student_shows_one_of_the_signs)
{
    BOOST_TEST((read<ShowSign>(R"({"sign":"hand"})").sign == StudentSign::hand));
    BOOST_TEST((read<ShowSign>(R"({"sign":"done"})").sign == StudentSign::done));
    BOOST_TEST((read<ShowSign>(R"({"sign":"none"})").sign == StudentSign::none));
    for (auto const* sign : {"\"fist\"", "\"\"", "true", "null"})
        BOOST_TEST((refusal_of(concat(R"({"sign":)", sign, "}")) == ClassError::message), sign);
    BOOST_TEST(sign_message(StudentSign::none) == R"({"sign":"none"})");
}

BOOST_AUTO_TEST_CASE(a_code_is_checked_as_people_type_it)
{
    BOOST_TEST(read<CheckCode>(R"({"check":"k7m 2qx"})").code == "K7M2QX");
    BOOST_TEST(read<CheckCode>(R"({"check":"nonsense"})").code == "");
    BOOST_TEST((refusal_of(R"({"check":5})") == ClassError::message));
    BOOST_TEST(checked_message("K7M2QX") == R"({"checked":"K7M2QX"})");
}

BOOST_AUTO_TEST_CASE(another_world_is_one_that_a_class_could_be_opened_with)
{
    auto const change = read<ChangeWorld>(R"({"world":{"world":"https://e.org/worlds/b.wbt","mode":"w3d"}})");
    BOOST_TEST(change.world == "https://e.org/worlds/b.wbt");
    BOOST_TEST(change.mode == "w3d");
    BOOST_TEST((refusal_of(R"({"world":{"world":"x","mode":"w3d"}})") == ClassError::world));
    BOOST_TEST((refusal_of(R"({"world":{"world":"https://e.org/b.wbt","mode":"vr"}})") == ClassError::world));
    BOOST_TEST((refusal_of(R"({"world":{"world":"https://e.org/b.wbt"}})") == ClassError::message));
    BOOST_TEST((refusal_of(R"({"world":"https://e.org/b.wbt"})") == ClassError::message));
    BOOST_TEST(world_message("w", "w3d") == R"({"world":{"world":"w","mode":"w3d"}})");
}

BOOST_AUTO_TEST_CASE(a_teacher_tells_some_or_all)
{
    auto const some = read<TellStudents>(R"({"tell":{"students":[1,2],"do":"pause"}})");
    BOOST_TEST((some.students == std::vector<StudentId>{1, 2}));
    BOOST_TEST((some.action == ClassAction::pause));
    BOOST_TEST(
        (read<TellStudents>(R"({"tell":{"students":null,"do":"start"}})").action == ClassAction::start));
    BOOST_TEST(
        (read<TellStudents>(R"({"tell":{"students":[1],"do":"lower"}})").action == ClassAction::lower));
    auto const all = read<TellStudents>(R"({"tell":{"students":null,"do":"message","text":" Look here. "}})");
    BOOST_TEST(!all.students);
    BOOST_TEST(all.text == "Look here.");
    for (auto const* tell :
         {R"({"do":"pause"})", R"({"students":5,"do":"pause"})", R"({"students":["1"],"do":"pause"})",
          R"({"students":null,"do":"explode"})", R"({"students":null,"do":"message"})",
          R"({"students":null,"do":"message","text":"\u0007"})"})
        BOOST_TEST((refusal_of(concat(R"({"tell":)", tell, "}")) == ClassError::message), tell);
    std::string many = "1";
    for (int i = 0; i < 200; ++i)
        many += ",1";
    BOOST_TEST(
        (refusal_of(concat(R"({"tell":{"do":"run","students":[)", many, "]}}")) == ClassError::message));
    BOOST_TEST((refusal_of(concat(R"({"tell":{"do":"message","students":null,"text":")",
                                  std::string(201, 'x'), "\"}}")) == ClassError::message));
}

BOOST_AUTO_TEST_CASE(the_short_messages_are_read)
{
    BOOST_TEST(read<SetSeats>(R"({"seats":5})").seats == 5u);
    BOOST_TEST((refusal_of(R"({"seats":0})") == ClassError::seats));
    BOOST_TEST(read<WatchPictures>(R"({"watch":true})").on);
    BOOST_TEST(!read<WatchPictures>(R"({"watch":false})").on);
    (void)read<CloseClass>(R"({"close":true})");
    (void)read<LeaveClass>(R"({"leave":true})");
    BOOST_TEST(read<ReportPicture>(R"({"picture":"/9j/"})").base64 == "/9j/");
}

BOOST_AUTO_TEST_CASE(anything_else_is_not_understood)
{
    for (auto const* text :
         {"", "{", "[]", "null", "5", "{}", R"({"close":false})", R"({"close":1})", R"({"what":true})",
          R"({"watch":true,"close":true})", R"({"teach":[]})", R"({"join":"K7M2QX"})", R"({"picture":5})",
          R"({"join":{"code":5,"name":"Ada"}})", "{\"join\":{\"code\":\"K7M2Q\",\"name\":\"\xc3\x28\"}}"})
        BOOST_TEST((refusal_of(text) == ClassError::message), text);
    BOOST_TEST((refusal_of(std::string(100, '[')) == ClassError::message));
    BOOST_TEST((refusal_of(concat(R"({"picture":")", std::string(class_limits::message, 'A'), "\"}")) ==
                ClassError::message));
}

BOOST_AUTO_TEST_CASE(what_is_sent_is_json_whatever_names_hold)
{
    StudentRow student;
    student.id = 1;
    student.name = "\"</script>";
    BOOST_TEST(student_message(student) ==
               R"({"student":{"id":1,"name":"\"</script>","state":"joined","time":0}})");
    student.sign = StudentSign::hand;
    student.why = "busy";
    student.ahead = 0;
    BOOST_TEST(student_message(student) ==
               R"({"student":{"id":1,"name":"\"</script>","state":"joined","time":0,)"
               R"("sign":"hand","why":"busy","ahead":0}})");
    student = StudentRow{};
    StudentProgram program;
    program.file = "a/\".py";
    student.program = &program;
    BOOST_TEST(student_message(student) == R"({"student":{"id":0,"name":"","state":"joined","time":0,)"
                                           R"("program":{"file":"a/\".py","changed":false}}})");
    program.is_changed = true;
    program.wrong_line = 3;
    program.goal = 23'400;
    BOOST_TEST(student_message(student) ==
               R"({"student":{"id":0,"name":"","state":"joined","time":0,)"
               R"("program":{"file":"a/\".py","changed":true,"line":3,"goal":23400}}})");
    student = StudentRow{};
    student.id = 1;
    student.name = "\"</script>";
    student.simulator = "ws://h:2001";
    student.state = StudentState::away;
    ClassRow row;
    row.code = "K7M2QX";
    row.key = "k";
    row.world = "w";
    row.mode = "mjpeg";
    row.seats = 30;
    row.reserved = 18;
    row.students = {student};
    row.machines = {"ws://h:2000"};
    BOOST_TEST(
        class_message(row) ==
        R"({"class":{"code":"K7M2QX","key":"k","world":"w","mode":"mjpeg","seats":30,"reserved":18,)"
        R"("students":[{"id":1,"name":"\"</script>","state":"away","time":0,"simulator":"ws://h:2001"}],)"
        R"("machines":["ws://h:2000"]}})");
    row.students.clear();
    row.network.addresses = {"192.168.1.5"};
    BOOST_TEST(class_message(row).ends_with(
        R"("machines":["ws://h:2000"],"network":{"addresses":["192.168.1.5"],"open":false}}})"));
    BOOST_TEST(gone_message(7) == R"({"gone":7})");
    BOOST_TEST(reserved_message(3) == R"({"reserved":3})");
    BOOST_TEST(picture_message(7, "/9j/") == R"({"picture":{"id":7,"jpeg":"/9j/"}})");
    JoinedRow joined;
    joined.id = 7;
    joined.token = "t";
    joined.seat = "s";
    joined.name = "Ada";
    joined.world = "w";
    joined.mode = "mjpeg";
    BOOST_TEST(joined_message(joined) ==
               R"({"joined":{"id":7,"token":"t","seat":"s","name":"Ada","world":"w","mode":"mjpeg"}})");
    joined.sign = StudentSign::done;
    BOOST_TEST(joined_message(joined) == R"({"joined":{"id":7,"token":"t","seat":"s","name":"Ada",)"
                                         R"("world":"w","mode":"mjpeg","sign":"done"}})");
    BOOST_TEST(code_message("K7M2QX") == R"({"code":"K7M2QX"})");
    auto const terms = picture_terms(1);
    BOOST_TEST(pictures_message(&terms) ==
               R"({"pictures":{"interval":500,"width":160,"height":120,"bytes":2800}})");
    BOOST_TEST(pictures_message(nullptr) == R"({"pictures":null})");
    TellStudents tell;
    BOOST_TEST(action_message(tell) == R"({"do":"pause"})");
    tell.action = ClassAction::message;
    tell.text = "Hi";
    BOOST_TEST(action_message(tell) == R"({"do":"message","text":"Hi"})");
    tell.action = ClassAction::take;
    tell.file = "a/a.py";
    tell.text.clear();
    BOOST_TEST(action_message(tell) == R"({"do":"take","file":"a/a.py","text":""})");
    BOOST_TEST(program_message(3, "a/a.py", "x\n") == R"({"program":{"id":3,"file":"a/a.py","text":"x\n"}})");
    BOOST_TEST(class_closed_message(ClassEnd::idle) == R"({"closed":"idle"})");
}

BOOST_AUTO_TEST_CASE(every_error_has_a_code_and_a_sentence)
{
    for (auto const error :
         {ClassError::off, ClassError::password, ClassError::tries, ClassError::code, ClassError::full,
          ClassError::name, ClassError::limit, ClassError::seats, ClassError::world, ClassError::message}) {
        auto const text = class_error_message(error);
        BOOST_TEST(is_object_of(text, "error"), text);
        BOOST_TEST(is_object_of(text, "text"), text);
        BOOST_TEST(text.ends_with(".\"}"), text);
    }
}

BOOST_AUTO_TEST_CASE(programs_are_texts_below_the_folder_of_the_controllers)
{
    auto const program = read<ReportProgram>(R"({"program":{"file":"a/a.py","text":"x\n"}})");
    BOOST_TEST(program.file == "a/a.py");
    BOOST_TEST(program.text == "x\n");
    auto const take =
        read<TellStudents>(R"({"tell":{"students":null,"do":"take","file":"a/a.py","text":""}})");
    BOOST_TEST(take.file == "a/a.py");
    for (std::string_view const rest :
         {R"("file":"../a.py","text":"")", R"("file":"a.py","text":"")", R"("file":"a/a.py")",
          R"("text":"x")", R"("file":"a/a.py","text":"\u0000")", R"("file":"a/a.py","text":5)"}) {
        BOOST_TEST((refusal_of(concat(R"({"program":{)", rest, "}}")) == ClassError::message), rest);
        BOOST_TEST((refusal_of(concat(R"({"tell":{"students":null,"do":"take",)", rest, "}}")) ==
                    ClassError::message),
                   rest);
    }
    auto const large = std::string(largest_editable + 1, 'x');
    BOOST_TEST((refusal_of(concat(R"({"program":{"file":"a/a.py","text":")", large, R"("}})")) ==
                ClassError::message));
}

BOOST_AUTO_TEST_SUITE_END()
