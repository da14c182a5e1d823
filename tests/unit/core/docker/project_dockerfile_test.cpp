#include "unit_test.hpp"

#include "core/docker/project_dockerfile.hpp"

using namespace webots_cloud::core;

// Protocol section 6.3.
BOOST_AUTO_TEST_SUITE(dockerfiles_of_projects)

namespace {

constexpr std::string_view own_label =
    "LABEL webots_cloud.server=s com.docker.compose.project=\"\" com.docker.compose.service=\"\"\n";

DockerfileTerms terms()
{
    DockerfileTerms terms;
    terms.images = "cyberbotics/webots.cloud";
    terms.default_image = "cyberbotics/webots.cloud:R2025a-ubuntu22.04";
    terms.server = "s";
    return terms;
}

/// The Dockerfile to build with, without our labels; or why there is none.
std::string read(std::string_view text)
{
    auto const read = project_dockerfile(text, "Dockerfile", terms());
    if (!read)
        return read.error().message();
    auto written = read->text;
    for (auto at = written.find(own_label); at != std::string::npos; at = written.find(own_label))
        written.erase(at, own_label.size());
    return written;
}

/// What is said of a line that is refused; otherwise what is built.
std::string said_of_line(int line, std::string_view text)
{
    auto const said = read(text);
    auto const beginning = "Line " + std::to_string(line) + " of Dockerfile can't be used on this server: ";
    return said.starts_with(beginning) ? said.substr(beginning.size()) : said;
}

} // namespace

BOOST_AUTO_TEST_CASE(each_instruction_is_built_in_a_line_of_its_own)
{
    BOOST_TEST(read("# syntax=evil.example/frontend\n# escape=`\n\nfrom scratch as Build\n"
                    "RUN  echo a \\\n  # a comment\n\n   b\\  \n  c\r\ncopy . /x\n"
                    "FROM cyberbotics/webots.cloud:R2025a-ubuntu22.04\nCOPY --from=build --chown=a:b /x /y\n"
                    "COPY --from=0 /x /z\n  CMD [\"a\",\\\n\"b\"]") ==
               "FROM scratch AS build\nRUN echo a    b  c\nCOPY . /x\n"
               "FROM cyberbotics/webots.cloud:R2025a-ubuntu22.04\nCOPY --from=build --chown=a:b /x /y\n"
               "COPY --from=0 /x /z\nCMD [\"a\",\"b\"]\n");
    BOOST_TEST(read("") == "");
    BOOST_TEST(read("# nothing") == "");
    BOOST_TEST(read("FROM scratch\nRUN a \\") == "FROM scratch\nRUN a\n");
}

// Where docker ended an instruction that we thought to go on, a stage of a stranger's could begin.
BOOST_AUTO_TEST_CASE(nothing_is_built_that_versions_of_docker_read_differently)
{
    BOOST_TEST(said_of_line(2, "FROM scratch\nRUN echo \\\\\nFROM x") == "it ends in two backslashes.");
    BOOST_TEST(said_of_line(2, "FROM scratch\nRUN echo \\ \\") == "it ends in two backslashes.");
    BOOST_TEST(said_of_line(2, "FROM scratch\nRUN echo \\ \\\n\n  # b\n") == "it ends in two backslashes.");
    for (auto const text : {"FROM scratch\nFROM\fx", "FROM scratch\nRUN a\vb", "FROM scratch\nRUN a\rFROM x",
                            "FROM scratch\nRUN \x01"})
        BOOST_TEST(said_of_line(2, text) == "it has control characters. Save the file as plain text.");
    BOOST_TEST(said_of_line(1, std::string_view("FROM scratch\0", 13)) ==
               "it has control characters. Save the file as plain text.");
    BOOST_TEST(said_of_line(2, "FROM scratch\nRUN cat <<EOF\nFROM scratch AS x\nEOF") ==
               "it has a here-document (\"<<\"). Put the text into a file of the project.");
    BOOST_TEST(read("FROM scratch\nRUN echo `\nFROM scratch AS b") ==
               "FROM scratch\nRUN echo `\nFROM scratch AS b\n");
    // A mark that Windows' editors put there is none of an instruction.
    BOOST_TEST(read("\xEF\xBB\xBF"
                    "FROM scratch") == "FROM scratch\n");
    for (auto const text : {"FROM scratch\n\xEF\xBB\xBFRUN a", "FROM scratch\n\xC2\xA0RUN a",
                            "FROM scratch\nONBUILD COPY --from=x / /", "FROM scratch\nINCLUDE x", "x\n\\",
                            "FROM scratch\nonbuild RUN a"})
        BOOST_TEST(read(text).ends_with("is not among the instructions that may be used."), text);
}

BOOST_AUTO_TEST_CASE(images_of_the_operator_and_of_registries_may_be_started_from)
{
    for (std::string const image :
         {"scratch", "cyberbotics/webots.cloud", "cyberbotics/webots.cloud:R2025a-ubuntu22.04",
          "cyberbotics/webots.cloud@sha256:0a", "docker.io/library/python:3.12", "ghcr.io/a/b/c:1",
          "registry.example:5000/a", "docker.io/a@sha256:0a"})
        BOOST_TEST(read("FROM " + image) == "FROM " + image + "\n");
    BOOST_TEST(read("FROM --platform=linux/amd64 scratch") == "FROM --platform=linux/amd64 scratch\n");
}

// Another simulation's, by its name or the beginning of its number, and services of this machine.
BOOST_AUTO_TEST_CASE(other_images_of_this_machine_may_not)
{
    for (std::string const image : {"webots-2000-1f3a9c4d-1-0a_webots",
                                    "a",
                                    "0a1b",
                                    "sha256:0a",
                                    "python:3.12",
                                    "cyberbotics/webots",
                                    "cyberbotics/webots.cloud-other:1",
                                    "cyberbotics/webots.cloud/x",
                                    "localhost/a",
                                    "localhost:5000/a",
                                    "127.0.0.1:5000/a",
                                    "169.254.169.254/a",
                                    "registry:5000/a",
                                    ".a/b",
                                    "a./b",
                                    "docker.io/",
                                    "docker.io",
                                    "docker.io:x/a",
                                    "docker.io:0/a",
                                    "0",
                                    "b"}) {
        BOOST_TEST(
            said_of_line(1, "FROM " + image).starts_with("it names the image \"" + image + "\" without"),
            image);
        BOOST_TEST(said_of_line(2, "FROM scratch AS a0\nCOPY --from=" + image + " / /")
                       .starts_with("it names the image \"" + image + "\" without"),
                   image);
    }
    BOOST_TEST(
        said_of_line(1, "FROM python:3.12") ==
        "it names the image \"python:3.12\" without its registry. Write docker.io/library/python:3.12, "
        "or start from an image of cyberbotics/webots.cloud.");
    BOOST_TEST(said_of_line(1, "FROM a/b AS c").find("Write docker.io/a/b, or") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_stage_is_known_once_it_has_ended)
{
    BOOST_TEST(read("FROM scratch AS a\nFROM A AS b\nCOPY --from=a / /") ==
               "FROM scratch AS a\nFROM a AS b\nCOPY --from=a / /\n");
    for (auto const source : {"b", "1", "2", "999", "1000", "", "$a", "${a}", "\"a\"", "-1"})
        BOOST_TEST(read(std::string("FROM scratch AS a\nFROM scratch AS b\nCOPY --from=") + source + " / /")
                       .starts_with("Line 3 of Dockerfile can't be used"),
                   source);
    BOOST_TEST(read("FROM scratch AS a\nCOPY --chown=a --from=a / /").starts_with("Line 2 of Dockerfile"));
    BOOST_TEST(said_of_line(1, "FROM a AS a").starts_with("it names the image"));
    BOOST_TEST(said_of_line(1, "FROM scratch AS 0").starts_with("the name of the stage"));
    BOOST_TEST(said_of_line(1, "FROM").starts_with("it names no image."));
    BOOST_TEST(said_of_line(1, "FROM scratch B").starts_with("it names no image."));
}

BOOST_AUTO_TEST_CASE(the_value_of_a_variable_is_what_is_looked_at_and_built)
{
    BOOST_TEST(read("ARG WEBOTS_DEFAULT_IMAGE\nFROM ${WEBOTS_DEFAULT_IMAGE}") ==
               "ARG WEBOTS_DEFAULT_IMAGE\nFROM cyberbotics/webots.cloud:R2025a-ubuntu22.04\n");
    BOOST_TEST(read("ARG V=3 W=\"$V.1\"\nARG I='docker.io/a:${W}'\nFROM $I AS b\nARG I=x\nFROM $I") ==
               "ARG V=3 W=\"$V.1\"\nARG I='docker.io/a:${W}'\nFROM docker.io/a:3.1 AS b\nARG I=x\n"
               "FROM docker.io/a:3.1\n");
    BOOST_TEST(said_of_line(2, "ARG I=victim\nFROM $I").starts_with("it names the image \"victim\" without"));
    BOOST_TEST(said_of_line(2, "ARG WEBOTS_DEFAULT_IMAGE=victim\nFROM $WEBOTS_DEFAULT_IMAGE") ==
               read("ARG WEBOTS_DEFAULT_IMAGE=victim\nFROM cyberbotics/webots.cloud:R2025a-ubuntu22.04"));
    for (auto const image : {"$J", "${I:-x}", "${I", "$", "$I$", "a$J", "${J}"})
        BOOST_TEST(said_of_line(2, std::string("ARG I=docker.io/a\nFROM ") + image) ==
                       std::string("\"") + image +
                           "\" has no value here. Write the name of the image itself.",
                   image);
}

BOOST_AUTO_TEST_CASE(options_are_those_that_we_know_and_docker_fetches_nothing_itself)
{
    for (auto const line : {"RUN --mount=type=bind,from=victim,target=/v cat /v/x", "COPY --from=victim / /",
                            "COPY --From=0 / /", "COPY --from=\"0\" / /", "COPY --link / /", "COPY -- / /",
                            "COPY --from / /", "ADD --from=0 / /", "ADD http://127.0.0.1/ /", "ADD $U /",
                            "ADD [\"http://a\", \"/\"]", "ADD git@a:b.git /"})
        BOOST_TEST(
            read(std::string("FROM scratch\n") + line).starts_with("Line 2 of Dockerfile can't be used"),
            line);
    BOOST_TEST(read("FROM scratch\nADD --chown=a:b x.tar.gz /\nRUN [\"a\", \"--b\"]") ==
               "FROM scratch\nADD --chown=a:b x.tar.gz /\nRUN [\"a\", \"--b\"]\n");
}

// By its labels a container in which a build has failed is found, and a simulator told from others.
BOOST_AUTO_TEST_CASE(whatever_a_project_says_of_labels_ours_come_after_it)
{
    BOOST_TEST(
        project_dockerfile("FROM scratch\nLABEL webots_cloud.server=x com.docker.compose.project=y\nRUN a",
                           "Dockerfile", terms())
            .value()
            .text == std::string("FROM scratch\n")
                         .append(own_label)
                         .append("LABEL webots_cloud.server=x com.docker.compose.project=y\n")
                         .append(own_label)
                         .append("RUN a\n"));
}

// What they have docker do in a build is not in the Dockerfile.
BOOST_AUTO_TEST_CASE(images_of_registries_are_named_and_triggers_in_them_found)
{
    auto const read =
        project_dockerfile("FROM scratch AS a\nFROM docker.io/b\nFROM a\nCOPY --from=docker.io/c / /\n"
                           "FROM cyberbotics/webots.cloud:1\nFROM ghcr.io/d/e:1",
                           "Dockerfile", terms());
    BOOST_TEST(read.value().bases == (std::vector<std::string>{"docker.io/b", "ghcr.io/d/e:1"}),
               boost::test_tools::per_element());
    BOOST_TEST(list_triggers("docker.io/b").back() == "docker.io/b");
    BOOST_TEST(!has_triggers("null\n"));
    BOOST_TEST(!has_triggers("[]\n"));
    BOOST_TEST(has_triggers("[\"COPY --from=0a1b / /\"]\n"));
    BOOST_TEST(has_triggers(""));
}

BOOST_AUTO_TEST_SUITE_END()
