#include "unit_test.hpp"

int main(int argc, char* argv[])
{
    auto const named = [] {
        boost::unit_test::framework::master_test_suite().p_name.value = "webots_cloud";
        return true;
    };
    return boost::unit_test::unit_test_main(+named, argc, argv);
}
