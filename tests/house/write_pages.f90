!! Writes the heads of the pages in docs/namelist to the standard output: one for each namelist group, from the schema.
program write_pages
   use, intrinsic :: iso_fortran_env, only: output_unit
   use razy_core_schema, only: group_spec_t
   use razy_core_schema_pages, only: group_page
   use razy_scenes_study, only: study_schema
   implicit none(type, external)

   type(group_spec_t), allocatable :: schema(:)
   integer :: i

   schema = study_schema("lumped")
   do i = 1, size(schema)
      write (output_unit, "(a)") group_page(schema(i))
   end do
end program write_pages
