#ifndef TEST_CLASS_LIST_MACROS_HPP
#define TEST_CLASS_LIST_MACROS_HPP
#define PLUGINLIB_EXPORT_CLASS(derived, base) static_assert(sizeof(derived) >= sizeof(base), "a plug-in");
#endif
