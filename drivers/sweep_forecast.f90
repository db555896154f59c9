!! What a sweep will take, from a few of its points: time, memory, size of the files.
module sweep_forecast
   use, intrinsic :: iso_fortran_env, only: output_unit
   use command_line, only: decimal
   use razy_core_kinds, only: i8, wp
   use razy_sweep_clock, only: seconds
   use razy_sweep_task, only: point_result_t
   use sweep_case, only: sweep_task_t
   implicit none(type, external)
   private

   public :: forecast

   !> Points that are timed, and time after which no more are begun, s.
   integer, parameter :: sample = 16
   real(wp), parameter :: longest = 20.0_wp
   !> Rank 0 keeps 24 bytes a point, and with starts 12 more and 8 for each number that varies.
   integer(i8), parameter :: memory_each = 24, memory_start = 12

   !> What is known of the sample.
   type :: sample_t
      integer :: points = 0, failed = 0
      real(wp) :: sum = 0.0_wp, least = huge(1.0_wp), most = 0.0_wp
      !> 64-bit words of the results, extrema.
      integer(i8) :: words = 0, extrema = 0
   end type sample_t

contains

   !> Compute points at equal distances and print what follows from them for a sweep on so many ranks.
   subroutine forecast(task, ranks)
      class(sweep_task_t), intent(inout) :: task
      integer, intent(in) :: ranks

      type(sample_t) :: found
      integer(i8) :: chain
      real(wp) :: mean, serial, parallel
      character(160) :: line

      call take_sample(task, found)
      mean = found%sum/found%points
      serial = mean*task%plan%points
      parallel = serial/ranks
      chain = 1
      if (task%plan%has_chains()) chain = task%plan%first_axis
      parallel = max(parallel, mean*chain, found%most)
      write (line, "(i0, a, i0, a, i0, a)") task%plan%points, " points: ", task%plan%points/task%plan%starts, " of the grid, ", &
         task%plan%starts, " starts each"
      write (output_unit, "(a)") trim(line)
      if (task%plan%has_chains()) then
         write (line, "(i0, a, i0, a)") task%plan%points/chain, " chains of ", chain, " points that follow each other"
         write (output_unit, "(a)") trim(line)
      end if
      write (line, "(a, i0, a, i0, a)") "timed: ", found%points, " points, ", found%failed, " failed, "
      write (output_unit, "(a)") trim(line)//" "//decimal(1000*mean, 3)//" ms on the average, "//decimal(1000*found%least, 3)// &
         " to "//decimal(1000*found%most, 3)//" ms"
      write (line, "(a, i0, a)") "time: "//span(serial)//" of one core; on ", ranks, " ranks "//span(parallel)
      write (output_unit, "(a)") trim(line)//", if the others are like these"
      call print_sizes(task, found)
   end subroutine forecast

   !> Time points at equal distances.
   subroutine take_sample(task, found)
      class(sweep_task_t), intent(inout) :: task
      type(sample_t), intent(out) :: found

      type(point_result_t) :: result
      integer(i8) :: n, point
      integer :: i
      real(wp) :: begun, time

      n = min(int(sample, i8), task%plan%points)
      do i = 1, int(n)
         point = 1 + ((2*i - 1)*task%plan%points)/(2*n)
         call result%clear()
         begun = seconds()
         call task%try_point(point, result)
         time = seconds() - begun
         found%points = i
         found%sum = found%sum + time
         found%least = min(found%least, time)
         found%most = max(found%most, time)
         found%words = found%words + result%n_integers + result%n_reals + 6
         found%extrema = found%extrema + task%watch%extrema_found()
         if (result%integers(1) /= 0) found%failed = found%failed + 1
         if (found%sum > longest) exit
      end do
   end subroutine take_sample

   subroutine print_sizes(task, found)
      class(sweep_task_t), intent(in) :: task
      type(sample_t), intent(in) :: found

      real(wp) :: extrema, file, memory
      character(160) :: line

      extrema = real(found%extrema, wp)/found%points
      ! Value, time and kind of each extremum; status, events, steps and the parameter of each point; its offsets.
      file = task%plan%points*(17*extrema + 28 + 8*size(task%watch%extrema))
      memory = real(memory_each*task%plan%points, wp)
      if (task%starts%wanted) then
         file = file + task%plan%points*(8.0_wp + 8*size(task%starts%range))
         memory = memory + task%plan%points*real(memory_start + 8*size(task%starts%range), wp)
      end if
      write (output_unit, "(a)") "result file: "//megabytes(file)//"; checkpoint until then: "// &
         megabytes(task%plan%points*8.0_wp*found%words/found%points)
      line = resident()
      write (output_unit, "(a)") "memory: "//trim(line)//" each rank; rank 0 "//megabytes(memory)//" more"
   end subroutine print_sizes

   !> What this process holds now, as Linux tells it.
   function resident() result(text)
      character(:), allocatable :: text

      character(120) :: line
      integer :: unit, status
      real(wp) :: kilobytes

      text = "as much as --dry-run on"
      open (newunit=unit, file="/proc/self/status", action="read", status="old", iostat=status)
      if (status /= 0) return
      do
         read (unit, "(a)", iostat=status) line
         if (status /= 0) exit
         if (index(line, "VmHWM:") /= 1) cycle
         read (line(7:index(line, "kB") - 1), *, iostat=status) kilobytes
         if (status == 0) text = megabytes(1024*kilobytes)
         exit
      end do
      close (unit)
   end function resident

   pure function megabytes(bytes) result(text)
      real(wp), intent(in) :: bytes
      character(:), allocatable :: text

      text = decimal(bytes/1.0e6_wp, 1)//" MB"
   end function megabytes

   !> A time in s, and in hours where that is long.
   pure function span(time) result(text)
      real(wp), intent(in) :: time
      character(:), allocatable :: text

      text = decimal(time, 1)//" s"
      if (time > 600.0_wp) text = text//" ("//decimal(time/3600, 2)//" h)"
   end function span

end module sweep_forecast
