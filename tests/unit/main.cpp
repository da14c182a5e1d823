#define BOOST_TEST_MODULE webots_cloud
#include <boost/test/unit_test.hpp>
