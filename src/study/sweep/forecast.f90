!! What a sweep will take, from a few of its points: time, memory, size of the files.
module razy_study_sweep_forecast
   use razy_core_kinds, only: i8, wp
   use razy_core_number, only: counted, decimal, to_text
   use razy_core_table, only: table_t
   use razy_core_text, only: append_text, string_t
   use razy_study_sweep_task, only: sweep_task_t
   use razy_sweep_clock, only: seconds
   use razy_sweep_packet, only: packet_t
   implicit none(type, external)
   private

   public :: forecast, most_timed

   !> Points that are timed at most.
   integer, parameter :: most_timed = 16
   !> Bytes that rank 0 keeps of each point, beside 8 for each number that varies; with starts more.
   integer(i8), parameter :: memory_each = 24, memory_start = 16

   !> What is known of the sample.
   type :: sample_t
      integer :: points = 0, failed = 0
      real(wp) :: sum = 0.0_wp, least = huge(1.0_wp), most = 0.0_wp
      !> 64-bit words of the checkpoint, bytes of the result file.
      integer(i8) :: words = 0, bytes = 0
   end type sample_t

contains

   !> Compute points at equal distances until `task` is to stop, and say in lines what follows from those that came to their ends
   !> for a sweep on so many ranks.
   subroutine forecast(task, ranks, lines)
      class(sweep_task_t), intent(inout) :: task
      integer, intent(in) :: ranks
      type(string_t), allocatable, intent(out) :: lines(:)

      type(sample_t) :: found
      integer(i8) :: chain
      real(wp) :: memory

      call take_sample(task, found)
      allocate (lines(0))
      associate (plan => task%plan)
         chain = 1
         if (plan%has_chains()) chain = plan%first_axis
         call append_text(lines, counted(to_text(plan%points), "point")//": "//to_text(plan%points/plan%starts)// &
                          " of the grid, "//counted(to_text(plan%starts), "start")//" each")
         if (plan%has_chains()) call append_text(lines, counted(to_text(plan%points/chain), "chain")//" of "// &
                                                 to_text(chain)//" points that follow each other")
         memory = plan%points*real(memory_each + 8*size(task%varied), wp)
         if (task%starts%wanted) memory = memory + plan%points*real(memory_start + 8*size(task%starts%range), wp)
         if (found%points > 0) then
            call tell_times(task, found, ranks, chain, lines)
         else
            call append_text(lines, "timed: no point, the first takes longer: time, result file and checkpoint are not known")
         end if
         call append_text(lines, "memory: "//resident()//" each rank; rank 0 "//megabytes(memory)//" more")
      end associate
   end subroutine forecast

   !> What follows from points that were timed.
   subroutine tell_times(task, found, ranks, chain, lines)
      class(sweep_task_t), intent(in) :: task
      type(sample_t), intent(in) :: found
      integer, intent(in) :: ranks
      integer(i8), intent(in) :: chain
      type(string_t), allocatable, intent(inout) :: lines(:)

      real(wp) :: file, mean, parallel, serial

      associate (plan => task%plan)
         mean = found%sum/found%points
         serial = mean*plan%points
         parallel = max(serial/ranks, mean*chain, found%most)
         call append_text(lines, "timed: "//counted(to_text(found%points), "point")//", "//to_text(found%failed)//" failed, "// &
                          decimal(1000*mean, 3)//" ms on the average, "//decimal(1000*found%least, 3)//" to "// &
                          decimal(1000*found%most, 3)//" ms")
         if (task%broken_off) call append_text(lines, "not timed: the point after them, which takes longer than was left; "// &
                                               "what follows is the least")
         call append_text(lines, "time: "//span(serial)//" of one core; on "//counted(to_text(ranks), "rank")//" "// &
                          span(parallel)//", if the others are like these")
         ! The parameters of a point, and what is known of its start.
         file = plan%points*(real(found%bytes, wp)/found%points + 8*size(task%varied))
         if (task%starts%wanted) file = file + plan%points*(8.0_wp + 8*size(task%starts%range))
         call append_text(lines, "result file: "//megabytes(file)//"; checkpoint until then: "// &
                          megabytes(plan%points*8.0_wp*found%words/found%points))
      end associate
   end subroutine tell_times

   !> Time points at equal distances; of a chain each begins as the input says.
   subroutine take_sample(task, found)
      class(sweep_task_t), intent(inout) :: task
      type(sample_t), intent(out) :: found

      !> Words of a record of the checkpoint beside those of a row.
      integer(i8), parameter :: head = 3
      type(packet_t) :: packet
      type(table_t) :: row
      integer(i8) :: n, point
      integer :: i, k
      real(wp) :: begun, time

      call task%describe(row)
      n = min(int(most_timed, i8), task%plan%points)
      do i = 1, int(n)
         point = 1 + ((2*i - 1)*task%plan%points)/(2*n)
         call row%rewind()
         begun = seconds()
         call task%run(point, row)
         time = seconds() - begun
         if (task%broken_off) return
         found%points = i
         found%sum = found%sum + time
         found%least = min(found%least, time)
         found%most = max(found%most, time)
         call packet%clear()
         call packet%put(point, row)
         found%words = found%words + packet%length - 2 + head
         do k = 1, row%count
            associate (column => row%column(k))
               if (column%is_stored()) found%bytes = found%bytes + product(column%extent)*column%bits/8
            end associate
         end do
         ! Each list of extrema has an offset, too.
         found%bytes = found%bytes + 8*size(task%watch%extrema)
         if (row%column(row%place_of("/point/status"))%integers(1) /= 0) found%failed = found%failed + 1
      end do
   end subroutine take_sample

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

end module razy_study_sweep_forecast
