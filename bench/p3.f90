!! The sweep of an input file on one core, again and again in one process: processor time of each, and the extrema.
!!
!! Usage: p3 INPUT REPEATS OUTPUT. One sweep goes first whose time does not count; its extrema go to OUTPUT as lines
!! `x speed time value kind` (none for the name -). Standard output: a line `point speed events steps` for each speed of that
!! sweep, a line `sweep seconds` for each of the others.
program p3
   use, intrinsic :: iso_fortran_env, only: output_unit
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_core_table, only: table_t
   use razy_core_text, only: string_t
   use razy_core_text_file, only: read_text_file
   use razy_input_input, only: input_t
   use razy_scenes_case, only: read_study
   use razy_study_sweep_task, only: new_sweep, sweep_task_t
   implicit none(type, external)

   type(sweep_task_t) :: task
   type(table_t) :: row
   type(input_t) :: input
   type(error_t), allocatable :: error
   character(:), allocatable :: text, file, output
   real(wp) :: start, finish
   integer :: repeats, sweep, unit
   integer(i8) :: point

   file = argument(1)
   text = argument(2)
   read (text, *) repeats
   output = argument(3)
   call read_text_file(file, text, error)
   if (.not. allocated(error)) call read_study(input, text, file, [string_t ::], error)
   if (.not. allocated(error)) call new_sweep(task, input, [real(wp) ::], error)
   if (allocated(error)) error stop error%message
   if (output /= "-") open (newunit=unit, file=output, status="replace", action="write")
   do sweep = 0, repeats
      call cpu_time(start)
      do point = 1, task%grid%n_points()
         call row%rewind()
         call task%run(point, row)
         if (number_of("/point/status") /= 0) error stop "a point of the sweep has failed"
         if (sweep == 0) call write_point()
      end do
      call cpu_time(finish)
      if (sweep > 0) write (output_unit, "(a, f0.6)") "sweep ", finish - start
   end do

contains

   !> A whole number of the point.
   integer(i8) function number_of(name)
      character(*), intent(in) :: name

      number_of = row%column(row%place_of(name))%integers(1)
   end function number_of

   subroutine write_point()
      real(wp) :: speed
      integer :: i

      speed = task%grid%axes(1)%value(point)
      write (output_unit, "(a, f0.6, 2(1x, i0))") "point ", speed, number_of("/point/events"), number_of("/point/steps")
      if (output == "-") return
      associate (extrema => task%watch%extrema(1))
         do i = 1, extrema%count
            write (unit, "(a, f0.6, 2(1x, es24.16), 1x, i0)") "x ", speed, extrema%time(i), extrema%value(i), extrema%kind(i)
         end do
      end associate
   end subroutine write_point

   function argument(number) result(word)
      integer, intent(in) :: number
      character(:), allocatable :: word

      integer :: length

      call get_command_argument(number, length=length)
      allocate (character(length) :: word)
      call get_command_argument(number, word)
   end function argument

end program p3
